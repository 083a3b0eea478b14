"""The browser of the tests: it draws, and what it must notice it notices."""

import asyncio

import pytest

from support.browser import is_outside, watch

HEAD = "<!doctype html><html lang=en><title>Static</title><link rel=icon href=data:,>"


def static(folder, body):
    path = folder / "page.html"
    path.write_text(HEAD + body, encoding="utf-8")
    return path.as_uri()


def test_a_static_page_is_read_as_people_read_it(page, tmp_path):
    page.goto(static(tmp_path, "<h1>Readings</h1><p id=n></p><script>n.textContent = 6 * 7</script>"))
    assert page.get_by_role("heading", name="Readings").is_visible()
    assert page.locator("#n").inner_text() == "42"


def test_three_dimensions_are_drawn_without_a_graphics_card(page, tmp_path):
    page.goto(static(tmp_path, "<canvas id=c></canvas>"))
    assert page.evaluate("c.getContext('webgl2') !== null")


def test_a_phone_in_dark_colours(watched, tmp_path):
    page = watched(viewport={"width": 390, "height": 844}, color_scheme="dark")
    page.goto(static(tmp_path, ""))
    assert page.evaluate("[innerWidth, matchMedia('(prefers-color-scheme: dark)').matches]") == [390, True]


@pytest.mark.parametrize(
    ("body", "problem"),
    [
        ("<script>throw Error('broken')</script>", "page: broken"),
        ("<script>console.error('told')</script>", "console: told"),
        ("<img src=http://levilab.invalid/x.png>", "a request to elsewhere: http://levilab.invalid/x.png"),
    ],
)
def test_what_a_page_must_not_do_fails_its_test(browser, tmp_path, body, problem):
    with pytest.raises(AssertionError, match=problem), watch(browser) as page:
        page.goto(static(tmp_path, body))


@pytest.mark.parametrize("address", ["https://127.0.0.1.example.org/", "wss://example.org/live", "//example.org/x"])
def test_elsewhere_is_elsewhere(address):
    assert is_outside(address)


async def answer():
    return 42


def test_beside_the_browser_other_tests_have_event_loops_of_their_own():
    assert asyncio.run(answer()) == 42
