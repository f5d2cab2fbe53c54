"""What editors of TOML have inside checks and completes files by their schemas; skipped where it is not installed."""

import json
import shutil
import subprocess
import time

import pytest

from pmor.app.records import STARTS
from pmor.app.start import start_text

TAPLO, TOMBI = shutil.which("taplo"), shutil.which("tombi")


def checked(folder, text):
    (folder / "my.toml").write_text(text, encoding="utf-8")
    done = subprocess.run(
        [TAPLO, "lint", "my.toml"], cwd=folder, capture_output=True, text=True, check=False, timeout=60
    )
    return done.returncode, done.stderr


@pytest.mark.skipif(TAPLO is None, reason="taplo is not installed")
@pytest.mark.parametrize("kind", STARTS)
def test_an_editor_checks_a_file_to_start_from(kind, tmp_path):
    text = start_text(kind)
    assert checked(tmp_path, text)[0] == 0
    head, _, rest = text.partition("\n")
    code, errors = checked(tmp_path, f"{head}\nno_key_of_any_file = 1\n{rest}")
    assert code == 1
    assert "no_key_of_any_file" in errors


class Editor:
    """A client of a language server."""

    def __init__(self, server):
        self.server = server
        self.ask(0, "initialize", processId=None, rootUri=None, capabilities={})
        self.tell("initialized")

    def tell(self, method, **parameters):
        self.send({"method": method, "params": parameters})

    def send(self, message):
        body = json.dumps({"jsonrpc": "2.0", **message}).encode()
        self.server.stdin.write(b"Content-Length: %d\r\n\r\n" % len(body) + body)
        self.server.stdin.flush()

    def ask(self, number, method, **parameters):
        """What the server answers; its own questions get nothing."""
        self.send({"id": number, "method": method, "params": parameters})
        while True:
            size = 0
            while line := self.server.stdout.readline().strip():
                size = int(line.split(b":")[1]) if line.lower().startswith(b"content-length") else size
            message = json.loads(self.server.stdout.read(size))
            if "method" in message and "id" in message:
                self.send({"id": message["id"], "result": None})
            elif message.get("id") == number:
                return message.get("result")


@pytest.mark.skipif(TOMBI is None, reason="tombi is not installed")
def test_an_editor_completes_keys_with_their_meanings(tmp_path):
    head = start_text("pair").partition("\n")[0]
    uri = (tmp_path / "my.toml").as_uri()
    with subprocess.Popen([TOMBI, "lsp"], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as server:
        try:
            editor = Editor(server)
            text = f"{head}\n[pair]\nmodule_mm = 2.5\n\n"
            document = {"uri": uri, "languageId": "toml", "version": 1, "text": text}
            editor.tell("textDocument/didOpen", textDocument=document)
            place = {"line": 3, "character": 0}
            found = None
            for number in range(1, 100):  # it answers with nothing until it has read its own settings
                found = editor.ask(number, "textDocument/completion", textDocument={"uri": uri}, position=place)
                if found:
                    break
                time.sleep(0.2)
        finally:
            server.kill()
    items = found["items"] if isinstance(found, dict) else found
    told = {item["label"]: json.dumps(item) for item in items}
    assert {"face_width_mm", "helix_angle_deg"} <= set(told)
    assert "module_mm" not in told
    assert "Normal pressure angle" in told["pressure_angle_deg"]
    assert "10 to 35 deg" in told["pressure_angle_deg"]
