"""The messages that docs/messages.md explains."""

import re

from support.paths import DOCS

QUOTED = re.findall(r"^### (.+)$", (DOCS / "messages.md").read_text("utf-8"), re.MULTILINE)
