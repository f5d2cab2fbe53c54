"""How much memory a process may have, whoever limits it."""

import resource

import pytest

from pmor.core.memory import memory_limits, memory_text

GIB = 2**30


def group_limit(root):
    return [limit.size for limit in memory_limits(root) if "control group" in limit.source]


def write(root, path, text):
    (root / path).parent.mkdir(parents=True, exist_ok=True)
    (root / path).write_text(text)


def test_the_smallest_limit_on_the_way_up_counts(tmp_path):
    write(tmp_path, "proc/self/cgroup", "0::/user/job/step\n")
    write(tmp_path, "sys/fs/cgroup/user/job/step/memory.max", "max\n")
    write(tmp_path, "sys/fs/cgroup/user/job/memory.max", f"{3 * GIB}\n")
    write(tmp_path, "sys/fs/cgroup/user/memory.max", f"{5 * GIB}\n")
    assert group_limit(tmp_path) == [3 * GIB]


def test_groups_of_the_first_version(tmp_path):
    write(tmp_path, "proc/self/cgroup", "5:cpu,cpuacct:/a\n4:memory:/a/b\n0::/\n")
    write(tmp_path, "sys/fs/cgroup/memory/a/b/memory.limit_in_bytes", "9223372036854771712\n")
    assert group_limit(tmp_path) == []
    write(tmp_path, "sys/fs/cgroup/memory/a/memory.limit_in_bytes", f"{GIB}\n")
    assert group_limit(tmp_path) == [GIB]


def test_a_container_does_not_see_the_path_that_the_host_gave_its_group(tmp_path):
    write(tmp_path, "proc/self/cgroup", "0::/docker/1a2b3c\n")
    write(tmp_path, "sys/fs/cgroup/memory.max", f"{2 * GIB}\n")
    assert group_limit(tmp_path) == [2 * GIB]


def test_without_control_groups_there_is_the_computer(tmp_path):
    (limit,) = memory_limits(tmp_path)
    assert limit.source == "this computer has"
    assert limit.size > GIB / 4


def test_limits_of_the_shell_are_known_with_what_they_count(tmp_path, monkeypatch):
    given = {resource.RLIMIT_AS: GIB, resource.RLIMIT_DATA: 2 * GIB}
    monkeypatch.setattr(resource, "getrlimit", lambda kind: (given[kind], resource.RLIM_INFINITY))
    _, addresses, data = memory_limits(tmp_path)
    assert (addresses.size, addresses.of_addresses, addresses.remedy) == (GIB, True, "raise ulimit -v")
    assert (data.size, data.of_addresses) == (2 * GIB, False)


@pytest.mark.parametrize(("size", "text"), [(130 * 2**20, "130 MiB"), (1.5 * GIB, "1.5 GiB"), (323.4 * GIB, "323 GiB")])
def test_sizes_read_naturally(size, text):
    assert memory_text(size) == text
