"""The docs name all that they must, everything that they name exists, and their style."""

import argparse
import re
import runpy
from collections.abc import Iterator
from dataclasses import fields
from functools import cache
from pathlib import Path

import pytest
from fastapi.routing import APIRoute, APIWebSocketRoute

from lupin_bridge import metrics
from lupin_bridge.app import FRAMES, ROUTED, create_app
from lupin_bridge.cli.command import parser
from lupin_twin.core import interfaces
from lupin_twin.core.parameters import ARGUMENTS, TwinParameters
from tests.support.docs import DOCS, ROOT, blocks, name_of, pages, without_blocks
from tests.support.structure import PACKAGES, ROOMS

GENERATOR = runpy.run_path(str(DOCS / "generate.py"))
EVERY_PAGE = pytest.mark.parametrize("page", pages(), ids=name_of)
# Those of `lupin-twin fleet` beside the bridge's.
FLEET_ROUTES = {"/api/sites", "/api/sites/{name}/map.svg", "/ws/sites", "/api/compare"}
# What the docs show of other programs.
FOREIGN_OPTIONS = {
    "--find-links",
    "--system-site-packages",
    "--base-paths",
    "--packages-select",
    "--packages-skip",
    "--params-file",
    "--ros-args",
    "--show-args",
    "--enclave",
    "--prefix",
    "--share",
    "--once",
    "--qos-reliability",
    "--qos-durability",
    "--cacert",
    "--user",
    "--now",
    "--no-deps",
    "--rm",
    "--network",
    "--volume",
    "--reverse-proxy",
    "--set-xauthrequest",
    "--help",
    "--version",
}


@cache
def reference() -> dict[str, str]:
    """The generated pages. They take a second, and every worker of pytest reads this file."""
    return {name: page() for name, page in GENERATOR["PAGES"].items()}


def listed(page: str) -> set[str]:
    """The first cells of a generated page's tables."""
    return set(re.findall(r"^\| `([^`]+)`", reference()[page], re.MULTILINE))


def options_of(parser: argparse.ArgumentParser) -> set[str]:
    return set(re.findall(r"(?<!\S)\[?(--[a-z][a-z-]*)", parser.format_help()))


def commands(of: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    [below] = [it for it in of._actions if isinstance(it, argparse._SubParsersAction)]
    return dict(below.choices)


def test_every_option_of_the_bridge_is_a_setting_of_the_reference() -> None:
    serve = commands(parser())["serve"]
    taken = options_of(serve) - {"--help", "--config"}
    assert len(taken) > 20
    # A default that does something is not "none".
    assert re.search(r"usual scan interval; [^-]* \(default:\s+0", serve.format_help())
    assert taken == {name for name in listed("settings") if name.startswith("--")}


def test_every_parameter_and_launch_argument_is_in_the_reference() -> None:
    assert listed("parameters") == {spec.name for spec in fields(TwinParameters)}
    assert listed("launch") == {argument.name for argument in ARGUMENTS}


def test_every_command_is_in_the_reference_with_all_of_its_options() -> None:
    roles = commands(parser())
    every = {f"lupin-twin {name}": it for name, it in roles.items()}
    every |= {f"lupin-twin journal {name}": it for name, it in commands(roles["journal"]).items()}
    for name, command in every.items():
        section = reference()["commands"].split(f"\n## {name}\n", 1)[1].partition("\n## ")[0]
        assert options_of(command) <= set(re.findall(r"--[a-z][a-z-]*", section)), name
    assert "\n## patrol_node\n" in reference()["commands"]
    assert "twin_node" in reference()["commands"]


def test_every_route_is_in_the_reference_and_only_existing_ones() -> None:
    routes = [route for module in ROUTED for route in module.router.routes]
    routed = {
        (method, route.path_format)
        for route in routes
        if isinstance(route, APIRoute)
        for method in (route.methods or set()) - {"HEAD"}
    }
    websockets = {route.path_format for route in routes if isinstance(route, APIWebSocketRoute)}
    described = set(re.findall(r"^## `(\w+) (/[^`]*)`$", reference()["http"], re.MULTILINE))
    plain = {name for name in listed("http") if name.startswith("/")}
    assert described <= routed
    answered = {path for _, path in routed} | websockets | {"/"}
    assert len(websockets) > 2
    assert answered == {path for _, path in described} | plain


def test_every_member_of_a_frame_and_of_a_type_is_in_the_reference() -> None:
    schemas = create_app(None).openapi()["components"]["schemas"]
    for name, schema in schemas.items():
        page = "frames" if name in {model.__name__ for model in FRAMES} else "types"
        section = reference()[page].split(f"\n## {name}\n", 1)[1].partition("\n(type-")[0]
        members = re.findall(r"^\| `(\w+)`", section, re.MULTILINE)
        assert members == list(schema.get("properties", {})), name


def test_every_message_is_in_the_reference_with_its_comments() -> None:
    for file in sorted((ROOT / "ros_node" / "lupin_msgs").glob("[ms][sr][gv]/*.[ms][sr][gv]")):
        assert f"\n## {file.stem} (" in reference()["messages"]
        assert file.read_text(encoding="utf-8").strip() in reference()["messages"]


def test_every_metric_is_in_the_reference() -> None:
    names = {
        f"{name}_total" if it.kind == "counter" else name for name, it in metrics.METRICS.items()
    }
    assert listed("metrics") == names | {*metrics.HISTOGRAMS}


def test_the_reference_shows_a_text_of_the_code_unchanged() -> None:
    """No character of it means anything to Markdown, except backticks."""
    prose = GENERATOR["prose"]
    assert prose("a_b *c* <d> [e] `f_g`") == r"a\_b \*c\* \<d\> \[e\] `f_g`"
    assert GENERATOR["grid"](("a",), [("`x|y`",)]).splitlines()[-1] == r"| `x\|y` |"


def test_the_policy_beside_the_systemd_unit_is_that_of_the_table() -> None:
    file = ROOT / "backend" / "deploy" / "sros2-policy.xml"
    assert file.read_text(encoding="utf-8") == GENERATOR["policy"](), "python docs/generate.py"


@EVERY_PAGE
def test_every_option_on_a_page_exists(page: Path) -> None:
    known = set(re.findall(r"--[a-z][a-z-]*", reference()["commands"])) | FOREIGN_OPTIONS
    shown = re.findall(r"`(--[a-z][a-z-]*)", without_blocks(page))
    for block in blocks(page):
        for line in block.text.replace("\\\n", " ").splitlines():
            own = re.search(r"\blupin-twin .*", line)
            shown += re.findall(r" (--[a-z][a-z-]*)", own.group() if own else "")
    assert set(shown) <= known


@EVERY_PAGE
def test_every_parameter_and_variable_on_a_page_exists(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    named = set(re.findall(r"-p (\w+):=", text))
    assert named <= {spec.name for spec in fields(TwinParameters)} | {"use_sim_time"}
    variables = set(re.findall(r"`(LUPIN_[A-Z_]+)", text))
    assert variables <= set(re.findall(r"LUPIN_[A-Z_]+", reference()["settings"]))


@EVERY_PAGE
def test_every_route_topic_and_metric_on_a_page_exists(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    routes = set(re.findall(r"`(?:GET |POST )?(/[^`\s]*)`", reference()["http"])) | FLEET_ROUTES
    # A name that continues in another route, such as `/api/tags`, is good enough.
    known = [re.sub(r"\\\{.*?\\\}", "[^/]+", re.escape(route)) for route in routes]
    for named in re.findall(r"(?:`|:8000|\.example)(/(?:api|ws)/[\w{}/.-]*)", text):
        found = [one for one in routes if one.startswith(f"{named}/")]
        assert found or any(re.fullmatch(one, named.rstrip(".")) for one in known), named
    topics = {f"/{it.name.lstrip('/')}" for it in (*interfaces.PUBLISHED, *interfaces.SERVICES)}
    for named in re.findall(r"`(/twin/[\w/]+)`", text):
        assert named in topics or named.startswith(f"/{interfaces.LAYERS_BELOW}"), named
    for named in re.findall(r"`(lupin_[a-z_]+(?:_total|_seconds|_bytes))`", text):
        assert named in listed("metrics"), named


@EVERY_PAGE
def test_every_make_target_on_a_page_exists(page: Path) -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    named = re.findall(r"(?:`|^)make ([a-z-]+)", page.read_text(encoding="utf-8"), re.MULTILINE)
    assert set(named) <= targets


@pytest.mark.parametrize(
    "page",
    [
        *pages(),
        *(ROOT / name for name in ("CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md")),
        *(ROOT / name / "README.md" for name in ("backend", "frontend", "ros_node", "tests")),
    ],
    ids=name_of,
)
def test_every_file_on_a_page_exists(page: Path) -> None:
    text = without_blocks(page)
    for name in re.findall(r"\]\(([^)#: ]+)(?:#[^)]*)?\)|src=\"([^\":]+)\"", text):
        target = (page.parent / "".join(name)).resolve()
        if not target.is_relative_to(DOCS / "reference"):  # those are generated
            assert target.exists(), name
        else:
            assert target.stem in reference(), name
    for name in re.findall(r"`((?:backend|frontend|ros_node|tests|docs)/[^`\s:]*)`", text):
        assert list(ROOT.glob(name.rstrip("/"))), name


def test_the_bridges_page_names_every_package_and_only_existing_files() -> None:
    text = (ROOT / "backend" / "README.md").read_text(encoding="utf-8")
    bridge = PACKAGES["lupin_bridge"]
    named = {name for cell in re.findall(r"`([^`]+)`", text) for name in cell.split()}
    files = {name for name in named if re.fullmatch(r"[a-z_]+/[a-z_]+\.py", name)}
    assert len(files) > 10
    assert [name for name in sorted(files) if not (bridge / name).is_file()] == []
    rooms = {f"{room}/" if (bridge / room).is_dir() else f"{room}.py" for room in ROOMS}
    assert rooms - named == set()


def test_the_ros_packages_page_names_every_module_of_the_twin_and_only_existing_ones() -> None:
    text = (ROOT / "ros_node" / "README.md").read_text(encoding="utf-8")
    twin = PACKAGES["lupin_twin"]
    modules = {
        file.relative_to(twin).as_posix()
        for room in (".", "core", "field", "ros", "runtime")
        for file in (twin / room).glob("*.py")
        if file.name != "__init__.py"
    }
    named = set(re.findall(r"(?<=`)[\w/]+\.py(?=`)", text)) - {"oracle_idw.py"}
    assert {name for name in named if not name.startswith("estimate/")} == modules


def test_the_tests_page_names_every_folder_and_only_existing_files() -> None:
    text = (ROOT / "tests" / "README.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`([\w/*]+(?:\.py|/))`", text))
    folders = {f"{path.parent.name}/" for path in (ROOT / "tests").glob("*/__init__.py")}
    assert folders <= named
    for name in named:
        assert list((ROOT / "tests").glob(name)), name


# Beside those of the guide: the files at the root, and the maps of the folders.
MORE = (
    "SECURITY.md",
    "CONTRIBUTING.md",
    "backend/README.md",
    "frontend/README.md",
    "ros_node/README.md",
    "tests/README.md",
)
EVERY_TEXT = pytest.mark.parametrize(
    "page", [*pages(), *(ROOT / name for name in MORE)], ids=name_of
)
MAX_WORDS = 25
# By folder of `docs/`, and the README.
MAX_LINES = {"how-to": 100, "explanation": 150, "README.md": 150}
# Words that are never right in these pages, with the right ones. Code may contain any of them.
INSTEAD = {
    r"houses?": "greenhouse",
    r"foretold|foretells?|foretelling": "predict, forecast",
    r"put(?:s|ting)? aside": "shelve",
    r"set(?:s|ting)? aside": "quarantine",
    r"rhythms?": "scan interval",
    r"thin(?:s|ned)? out": "delete",
    r"half[- ]made": "stale",
    r"goodbye": "shutdown, close",
    r"doorman|guests|crowd|turn(?:s|ed)? out": "connections, evict",
    r"(?:is|are|was|were|be|been) told": "reported, notified",
    r"(?:is|are|was|were|be|been|has|have|had) heard|heard (?:of|from)": "received",
    r"lately": "recently",
    r"who(?:ever)? asks|what is told|what is asked": "the client, the request",
}
SENTENCE_END = re.compile(r"(?<=[.!?])(?<!e\.g\.)(?<!i\.e\.)[\"')]*\s+")


def texts(page: Path) -> Iterator[tuple[int, str]]:
    """(Line, text) of each heading, paragraph, item of a list and cell of a table."""
    begun, waiting = 0, ""
    for number, line in enumerate([*without_blocks(page).splitlines(), ""], 1):
        text = line.strip()
        is_new = not text or re.match(r"[-*+|#:>]|\d+\. |\(.*\)=$|<", text)
        if is_new and waiting:
            yield begun, waiting
            waiting = ""
        if text.startswith("|"):
            yield from ((number, cell) for cell in re.split(r"(?<!\\)\|", text) if cell.strip())
        elif text and not re.fullmatch(r"<!--.*-->|\(.*\)=|:.*:", text):
            begun = number if not waiting else begun
            waiting = f"{waiting} {text}".strip()


def plain(text: str) -> str:
    """The text that is read: no markup, a piece of code or an address as one word."""
    text = re.sub(r"!\[[^\]]*\]\([^)]*\)|<[^>]*>", " ", text)
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"`[^`]*`|https?://\S+", "code", text)
    return re.sub(r"^[-*+#>\s]+|^\d+\.\s|[*_]{1,2}(?=\w)|(?<=\w)[*_]{1,2}", "", text).strip()


@EVERY_TEXT
def test_a_sentence_has_at_most_25_words(page: Path) -> None:
    long = [
        f"{page.name}:{line}: {len(sentence.split())} words: {sentence}"
        for line, text in texts(page)
        for sentence in SENTENCE_END.split(plain(text))
        if len(sentence.split()) > MAX_WORDS
    ]
    assert not long, "\n".join(long)


@EVERY_TEXT
def test_the_words_are_those_of_the_field(page: Path) -> None:
    wrong = [
        f"{page.name}:{line}: {found.group()!r}, must be {better}"
        for line, text in texts(page)
        for word, better in INSTEAD.items()
        if (found := re.search(rf"\b(?:{word})\b", plain(text), re.IGNORECASE))
    ]
    assert not wrong, "\n".join(wrong)


@EVERY_TEXT
def test_a_page_has_a_limited_length(page: Path) -> None:
    inside = page.relative_to(DOCS if page.is_relative_to(DOCS) else ROOT)
    limit = MAX_LINES.get(inside.parts[0], 400)
    assert len(page.read_text(encoding="utf-8").splitlines()) <= limit


def test_the_rules_find_their_violations(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "# A page\n\n- An item\n  of two lines. And `one two` more.\n\n"
        "```sh\nno text\n```\n\n| a cell | [a link](https://example.org) |\n",
        encoding="utf-8",
    )
    found = [plain(text) for _, text in texts(page)]
    assert found == ["A page", "An item of two lines. And code more.", "a cell", "a link"]
    assert len(SENTENCE_END.split("One. Two? (Three, e.g. four.) code is five.")) == 4
