"""Hand-written files have a limited length."""

from pathlib import Path

ROOT = Path(__file__).parents[1]
MAX_LINES = 450
HAND_WRITTEN = {
    "backend": ("*.py", "*.html", "*.css", "*.js"),
    "ros_node": ("*.py",),
    "tests": ("*.py", "*.mjs"),
    "frontend/src": ("*.ts", "*.tsx", "*.css"),
    "frontend/scripts": ("*.mjs",),
}
# Generated, or built.
NOT_BY_HAND = (
    "frontend/src/contract/openapi.gen.ts",
    "backend/lupin_bridge/static/",
    "backend/lupin_bridge/guide/",
)


def test_no_hand_written_file_is_too_long() -> None:
    long = {}
    for folder, patterns in HAND_WRITTEN.items():
        for file in (file for pattern in patterns for file in (ROOT / folder).rglob(pattern)):
            path = file.relative_to(ROOT).as_posix()
            lines = len(file.read_text(encoding="utf-8").splitlines())
            if lines > MAX_LINES and not path.startswith(NOT_BY_HAND):
                long[path] = lines
    assert long == {}, f"more than {MAX_LINES} lines"
