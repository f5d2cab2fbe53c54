"""The kinds of campaigns that there are."""

from pmor.campaigns.gearboxes import GEARBOXES
from pmor.campaigns.kind import Kind
from pmor.campaigns.pairs import PAIRS
from pmor.campaigns.sets import SETS

#: by the key of a campaign file that names the base file
KINDS: dict[str, Kind] = {kind.key: kind for kind in (PAIRS, SETS, GEARBOXES)}
