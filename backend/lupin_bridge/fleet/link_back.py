"""The page of one greenhouse with a way back to all of them: the page itself knows of no others."""

from __future__ import annotations

from hashlib import blake2b
from html import escape
from pathlib import Path
from typing import Final
from urllib.parse import parse_qs

from fastapi import Request, Response

from lupin_bridge.routes.answers import has_etag, not_modified
from lupin_bridge.serving.admission import REVALIDATE

_STYLE: Final = '<link rel="stylesheet" href="./fleet-back.css" /></head>'
# Which of them is shown is the page's to say, see `fleet-back.css`.
_WORDS: Final = "".join(
    f'<span lang="{language}">{words}</span>'
    for language, words in {
        "en": "All greenhouses",
        "de": "Alle Gewächshäuser",
        "nl": "Alle kassen",
        "es": "Todos los invernaderos",
    }.items()
)
_ROOT: Final = '<div id="root">'


class SitePage:
    """`index.html` of the folder; there may be none."""

    def __init__(self, static_folder: Path) -> None:
        file = static_folder / "index.html"
        self._text = file.read_text(encoding="utf-8") if file.is_file() else ""

    def answer(self, request: Request) -> Response | None:
        """The page, with its query on the way back too; None: as it is, if it is there at all."""
        query = request.url.query
        if not self._text or "kiosk" in parse_qs(query, keep_blank_values=True):
            return None
        to = escape(f"../../?{query}" if query else "../../")
        link = f'<nav class="fleet-back"><a href="{to}">‹ {_WORDS}</a></nav>{_ROOT}'
        body = self._text.replace("</head>", _STYLE, 1).replace(_ROOT, link, 1).encode()
        etag = f'"{blake2b(body, digest_size=12).hexdigest()}"'
        if has_etag(request, etag):
            return not_modified(etag)
        return Response(body, 200, {"ETag": etag, **REVALIDATE}, "text/html; charset=utf-8")
