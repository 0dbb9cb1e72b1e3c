"""Where elements are in the window, and whether they can be clicked."""

from contextlib import suppress

from playwright.sync_api import Locator, expect

from tests.browser.hmi import Box, Hmi

# Matching elements that cannot be clicked: covered by another, or out of sight.
_OUT_OF_REACH = """(selector) => [...document.querySelectorAll(selector)]
  .filter((e) => e.checkVisibility())
  .filter((e) => {
    e.scrollIntoView({ block: 'nearest', inline: 'nearest' });
    const box = e.getBoundingClientRect();
    const hit = document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2);
    const thing = 'label, button, a, li, tr';
    return !(hit && (e.contains(hit) || e.closest(thing) === (hit.closest(thing) ?? hit)));
  })
  .map((e) => e.ariaLabel || e.textContent || e.outerHTML)"""

_PLACES = """(selectors) => selectors.map((selector) => {
  const box = document.querySelector(selector).getBoundingClientRect();
  return [box.left, box.top, box.right, box.bottom];
})"""

# Words within one that lie below the other, in the same row.
_WORDS_BELOW = """([selector, above]) => [...document.querySelectorAll(selector)].flatMap((it) => {
  const over = [...it.parentElement.querySelectorAll(above)]
    .map((each) => each.getBoundingClientRect());
  const words = document.createTreeWalker(it, NodeFilter.SHOW_TEXT);
  const found = [];
  while (words.nextNode()) {
    if (words.currentNode.parentElement.closest('.unseen')) continue;
    const range = document.createRange();
    range.selectNode(words.currentNode);
    for (const box of range.getClientRects())
      if (over.some((one) => one.left < box.right - 1 && box.left < one.right - 1 &&
        one.top < box.bottom - 1 && box.top < one.bottom - 1)) found.push(range.toString());
  }
  return found;
})"""

# How many lines its words take.
LINES = """(e) => {
  const range = document.createRange();
  range.selectNodeContents(e);
  return new Set([...range.getClientRects()].map((box) => box.top)).size;
}"""


def place(thing: Locator) -> Box:
    """Its position in the window, pixels."""
    box = thing.bounding_box()
    assert box is not None
    left, top = round(box["x"]), round(box["y"])
    return Box(left, top, left + round(box["width"]), top + round(box["height"]))


def places(hmi: Hmi, *selectors: str) -> list[Box]:
    """The position of each one's first match in the window, pixels; all of one moment."""
    found = hmi.page.evaluate(_PLACES, selectors)
    return [Box(*(round(each) for each in box)) for box in found]


def words_below(hmi: Hmi, selector: str, above: str) -> list[str]:
    found = hmi.page.evaluate(_WORDS_BELOW, [selector, above])
    assert isinstance(found, list)
    return found


def out_of_reach(hmi: Hmi, selector: str) -> list[str]:
    found = hmi.page.evaluate(_OUT_OF_REACH, selector)
    assert isinstance(found, list)
    return found


def expect_in_reach(hmi: Hmi, selector: str) -> None:
    """Wait until every match can be clicked: a layout takes more than one step."""
    expect(hmi.page.locator(selector).first).to_be_attached()
    missed: list[str] = []

    def is_in_reach() -> bool:
        missed[:] = out_of_reach(hmi, selector)
        return not missed

    with suppress(AssertionError):
        hmi.expect(is_in_reach, "all in reach")
    assert missed == [], missed
