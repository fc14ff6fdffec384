#!/usr/bin/env python3
"""The pages of `rungd web` in a real browser: Chromium, headless, driven by Playwright.

usage: tests/browser.py [BINARY] [WORDS ...]
       BINARY: default target/release/rungd, or RUNGD=PATH; WORDS: only the checks with one of them in their name

Starts a controller and `rungd web`, and acts like a user: looks at a ladder with its power, steps through the
last minute, asks why, searches, zooms, signs in, writes, stops and reloads the controller; with a mouse, with the
keyboard alone, on a narrow screen, in light and in dark colours. A page of a different origin tries to read and to
write. Pictures of all pages are kept in target/browser/ for inspection; UPDATE_PICTURES=1 writes the one of README.md. No check depends on the machine's
speed: each waits for its expected result, up to PATIENCE. Exit code 77: Chromium or Playwright is missing.
"""

import http.server
import os
import re
import shutil
import subprocess
import sys
import threading
import time

import browser_rig as rig
from browser_axe import axe_core_finds_nothing_serious_on_any_page
from browser_outputs import what_is_shown_of_an_output_is_what_the_device_got
from browser_hold import HOLD_CHECKS
from browser_lift import LIFT_CHECKS
from browser_panels import PANEL_CHECKS
from browser_rights import RIGHTS_CHECKS
from browser_rig import CONTROLLER, LADDER, MORE, PAGES, PICTURES, Foreign, Look, Pages, Plant, wait_for

USER, PASSWORD = "anna", "correct horse"


# --- The checks ----------------------------------------------------------------------------------


def every_page_loads(test):
    look = test.look()
    for name in PAGES:
        look.open(name)
        look.picture(name.replace("/", "-"))
    look.fine()


def the_lit_wires_are_those_of_the_scan(test):
    test.plant.say("write", "level", "50")
    test.plant.say("write", "start", "ON")
    look = test.look()
    look.open("ladder/Main")
    look.until("document.querySelector('[data-rung=\"1\"] g.coil.on')")
    look.hold()
    look.picture("held")
    for _ in range(3):
        wrong = look.says(WRONG_WIRES)
        assert wrong["compared"] >= 5 and not wrong["rungs"], wrong
        step(look, ",", -1)
    look.fine()


def a_compare_shows_both_sides_and_a_call_folds_its_subroutine_out(test):
    test.plant.say("write", "level", "70")
    test.plant.say("write", "status", "8")
    look = test.look()
    look.open("ladder/Main")
    sides = "[...document.querySelectorAll('[data-rung=\"5\"] .sides')].map(of => of.textContent).join()"
    look.until(f"{sides}.startsWith('139 > 120,') && {sides}.endsWith(' < 20s')")
    look.until("document.querySelector('[data-rung=\"5\"] .words').textContent.includes('status.3 = ON')")
    assert look.says("document.querySelector('[data-rung=\"5\"] g[data-name=\"status.3\"]').classList.contains('on')")
    progress = "document.querySelector('[data-rung=\"%s\"] g.box .sides')?.textContent"
    look.until(f"/^[0-9]+ of 5$/.test({progress % 2}) && /^[0-9].* of 20s$/.test({progress % 3})")
    look.says("document.querySelector('[data-rung=\"5\"]').scrollIntoView()")
    look.picture("compares")
    call = "[data-rung='5'] g.box[data-mnemonic=CALL]"
    below = "document.querySelector('[data-rung=\"Drain:1\"]')"
    top = "document.querySelector('[data-rung=\"6\"]').offsetTop"
    before = look.says(top)
    look.page.click(call)
    look.until(f"{below} && ({below}.querySelector('.sides') || {{}}).textContent === '70 > 90'")
    assert look.says(f"document.querySelector({call!r}).getAttribute('aria-expanded')") == "true"
    assert look.says(f"{below}.previousElementSibling.dataset.rung") == "5"
    assert look.says(top) > before
    look.until(f"{below}.querySelectorAll('.wire.on').length > 0")
    # A CALL within it too.
    deep = "document.querySelector('[data-rung=\"Deep:1\"]')"
    look.page.click("[data-rung='Drain:2'] g.box[data-mnemonic=CALL]")
    look.until(f"{deep} && {deep}.querySelector('.sides').textContent === '70 > 30'")
    look.until(f"{deep}.querySelector('g.coil.on')")
    assert look.says(f"{deep}.previousElementSibling.dataset.rung") == "Drain:2"
    look.picture("subroutine")
    # Live: the values below the CALL follow the controller, as those of the page's own rungs do.
    test.plant.say("write", "level", "95")
    look.until(f"{below}.querySelector('.sides').textContent === '95 > 90'")
    look.page.focus(call)
    look.page.keyboard.press("Enter")
    look.until(f"!{below} && !{deep}")
    assert look.says(top) == before
    assert look.says("location.hash") == "#ladder/Main"
    test.plant.say("write", "level", "70")
    test.plant.say("write", "status", "0")
    look.fine()


# Compares the classes of each drawn rung with the power that the server returns for the same scan.
WRONG_WIRES = """async () => {
  const query = { element: view.element, from: view.from, to: view.to, hold: state.hold, scan: state.scan };
  const event = await (await fetch('/api/scan?' + new URLSearchParams(query))).json();
  const rungs = [];
  let compared = 0;
  for (const [number, power] of Object.entries(event.power)) {
    const place = document.querySelector(`[data-rung="${number}"]`);
    if (!place) continue;
    const lit = [...place.querySelectorAll('[data-p]')].map(of => of.classList.contains('on') ? '1' : '0').join('');
    compared++;
    if (place.classList.contains('idle') !== (power === null) || (power !== null && lit !== power)) rungs.push([number, lit, power]);
  }
  return { rungs, compared };
}"""


def step(look, key, by):
    before = look.says("state.scan")
    look.page.keyboard.press(key) if len(key) == 1 else look.page.click(key)
    look.until("scan => state.scan === scan", before + by)


def scans_are_stepped_by_keys_and_buttons(test):
    look = test.look()
    look.open("ladder/Main")
    assert look.page.locator("[data-step]").first.is_disabled()
    # Waits until there are some scans to step through.
    look.until("state.scans[1] > state.scans[0] + 5")
    look.hold()
    for key, by in [(",", -1), (",", -1), (".", 1), ("[data-step] >> nth=0", -1), ("[data-step] >> nth=1", 1)]:
        step(look, key, by)
    look.page.focus("#scan")
    look.page.keyboard.press("Home")
    look.until("state.scan === state.scans[0]")
    # There is no scan before the first one: this step does nothing.
    look.page.keyboard.press(",")
    look.page.click("#hold")
    look.until("!state.hold && state.scan > state.scans[0] + 5")
    look.fine()


def why_leads_to_how_it_could_change(test):
    look = test.look()
    look.open("ladder/Main")
    look.page.locator('[data-rung="1"] g[data-name="halt"]').click()
    look.page.locator("#why .how button").click()
    look.until("document.querySelector('#why .how pre')?.textContent.startsWith('write 1 into halt; halt is ON')")
    look.picture("how")
    look.page.keyboard.press("Escape")
    look.fine()


def a_click_and_enter_ask_why(test):
    look = test.look()
    look.open("ladder/Main")
    contact = look.page.locator('[data-rung="1"] g[data-name="halt"]')
    contact.click()
    look.until("document.querySelector('#why pre')?.textContent.startsWith('halt (C1) is OFF')")
    look.page.keyboard.press("Escape")
    assert look.page.locator("#why").is_hidden()
    coil = look.page.locator('[data-rung="1"] g[data-name="lamp"]').last
    coil.focus()
    look.page.keyboard.press("Enter")
    look.until("document.querySelector('#why pre')?.textContent.startsWith('lamp (Y0) is ')")
    look.picture("why")
    # A link in the answer, pressed by the keyboard, asks about a further operand.
    further = look.page.locator("#why pre button", has_text="level").first
    further.focus()
    look.page.keyboard.press("Enter")
    look.until("document.querySelector('#why pre')?.textContent.startsWith('level (D0) is ')")
    look.page.keyboard.press("Escape")
    assert look.page.locator("#why").is_hidden()
    name = "document.activeElement.dataset.name"
    assert look.says(name) == "lamp", f"the focus returns: {look.says(name)}"
    look.fine()


def search_finds_a_tag(test):
    look = test.look()
    look.open("tags")
    for words, found in [("people", "level"), ("Y1", "horn"), ("CT0", "parts.Acc"), ("la mp", "lamp")]:
        look.page.fill("#find", words)
        look.until("name => { const all = [...document.querySelectorAll('main tbody tr td:first-child')]"
                   ".map(of => of.textContent); return all.includes(name) && all.length < 10; }", found)
    look.page.fill("#find", "nothing is called so")
    look.until("document.querySelectorAll('main tbody tr').length === 0")
    look.until("/no tag/.test(document.querySelector('main').textContent)")
    look.fine()


def a_trend_is_zoomed(test):
    for value in ["20", "70", "30"]:
        test.plant.say("write", "level", value)
    look = test.look()
    look.open("trend/level")
    said = "document.querySelector('main p[role=status]').textContent"

    def changes(act):
        before = look.says(said)
        act()
        look.until(f"before => {said} !== before", before)

    canvas = look.page.locator("canvas")
    canvas.focus()
    changes(lambda: look.page.keyboard.press("+"))
    changes(lambda: look.page.keyboard.press("ArrowLeft"))
    changes(lambda: look.page.keyboard.press("-"))
    canvas.hover()
    changes(lambda: look.page.mouse.wheel(0, -300))
    changes(lambda: look.page.mouse.wheel(0, 300))
    changes(lambda: look.page.click("[aria-label='zoom in']"))
    look.fine()


def a_trend_over_hours_comes_from_the_scan_log(test):
    plant = Plant(controller=CONTROLLER + '[record]\ndir = "history"\n')
    pages = None
    try:
        plant.say("write", "level", "77")
        plant.say("write", "level", "5")
        # A power cut, and another process: the memory of the first one is gone, its files are there.
        wait_for("the values on the disk", lambda: any(
            plant.say("write", "level", str(n)) and os.listdir(os.path.join(plant.folder, "history")) for n in [5]))
        plant.process.terminate()
        plant.process.wait()
        plant.start()
        plant.say("write", "level", "30")
        pages = Pages(plant)
        look = test.look(pages)
        look.open("trend/level")
        look.page.get_by_role("button", name="10 min").click()
        answer = "(async () => await (await fetch('/api/trend?operand=level&minutes=10')).json())()"

        def is_read():
            got = look.says(answer)
            # The newest quarter of a minute is that of the running process, until it is over.
            return got if 77 in [point[2] for point in got["points"]] else None

        got = wait_for("the scan log of ten minutes", is_read)
        values = [point[2] for point in got["points"]]
        assert 77 in values and values[-1] == 30, values
        assert "not recorded" in {gap[2] for gap in got["gaps"]}, got["gaps"]
        look.until("/not recorded/.test(document.querySelector('main p[role=status]').textContent)")
        look.picture("trend-10-minutes")
        look.fine()
    finally:
        plant.end()
        if pages:
            pages.end()
        shutil.rmtree(plant.folder, ignore_errors=True)


def a_panel_shows_what_it_should(test):
    test.plant.say("write", "level", "40")
    test.plant.say("write", "start", "ON")
    look = test.look()
    look.open("panel")
    look.until("document.querySelector('[data-lamp=lamp]').textContent === '● ON'")
    look.until("document.querySelector('[data-bar=level] > div').style.width === '40%'")
    look.until("document.querySelector('[data-value-of=level]').textContent === '40'")
    # The trend is not empty.
    look.until("""() => { const of = document.querySelector('canvas');
      return of.width && of.getContext('2d').getImageData(0, 0, of.width, of.height).data.some(part => part); }""")
    assert look.page.locator("button.big").is_disabled(), "nobody has signed in"
    look.fine()


def a_user_signs_in_and_writes(test):
    users = os.path.join(test.plant.folder, "users")
    command = [rig.RUNGD, "web", "passwd", USER, "--users-file", users]
    subprocess.run(command, input=PASSWORD + "\n", text=True, check=True, capture_output=True)
    pages = Pages(test.plant, "--users-file", users)
    try:
        look = test.look(pages)
        look.picture("sign-in")
        sign_in(look, "wrong horse")
        look.until("/no user has this name/.test(document.querySelector('[role=alert]').textContent)")
        sign_in(look, PASSWORD)
        look.page.get_by_role("button", name=f"Sign out {USER}").wait_for()
        test.plant.say("write", "start", "OFF")
        look.open("panel")
        look.picture("panel-signed-in")
        # The change says until when it may be begun: 8 s after the click, by the server's clock.
        with look.page.expect_request("**/api/write") as asked:
            look.page.click("button.big")
        deadline = asked.value.post_data_json["deadline"]
        now_ms = time.clock_gettime(time.CLOCK_BOOTTIME) * 1000
        assert re.fullmatch("[0-9a-f]{16}", deadline["clock"]) and now_ms - 60_000 < deadline["ms"] < now_ms + 8_100, deadline
        wait_for("a write", lambda: test.plant.value("start") is True or test.plant.value("start") == 1)
        look.until("/ON: waits for the ladder/.test(document.querySelector('main').textContent)")
        # A value of the list of tags, where the controller judges it.
        look.open("tags")
        field = look.page.get_by_label("new value of level")
        field.fill("33")
        field.press("Enter")
        wait_for("a value", lambda: test.plant.value("level") == 33)
        # The shown value changes, and the field accepts a further value.
        look.until("document.querySelector('[data-value=level]').textContent === '33'")
        field.fill("1000")
        field.press("Enter")
        look.until("/takes 0 to 100/.test(document.querySelector('main').textContent)")
        look.page.get_by_role("button", name="Sign out").click()
        look.page.get_by_role("heading", name="Sign in").wait_for()
        # Expected errors: 401 for the wrong password and for requests without a session, 409 for a value out of range.
        look.errors = [of for of in look.errors if not re.search("status of 4(01|09)", of)]
        look.fine()
    finally:
        pages.end()


def sign_in(look, password):
    look.page.get_by_label("User").fill(USER)
    look.page.get_by_label("Password").fill(password)
    look.page.get_by_role("button", name="Sign in").click()


# A page whose requests are answered late or refused must end with what its address names.


def a_late_answer_does_not_bring_an_earlier_page_back(test):
    look = test.look()
    look.open("overview")
    waiting = []
    look.page.route("**/api/panels", lambda route: waiting.append(route))
    look.page.reload()
    look.until_asked(waiting, 1)
    look.page.goto(f"{look.origin}/#ladder/Main")
    look.until_asked(waiting, 2)
    # The later request, which is of the ladder's page, is answered first.
    waiting[1].continue_()
    look.open("ladder/Main")
    with look.page.expect_response("**/api/session"):
        waiting[0].continue_()
    look.page.unroute("**/api/panels")
    for _ in range(5):
        step_of_events(look)
    assert look.says("document.querySelectorAll('.rung').length > 0"), "the overview is back"
    look.fine()


def step_of_events(look):
    before = look.says("state.scan")
    look.until("scan => state.scan > scan", before)


def a_refused_request_is_sent_again(test):
    for name, path, found in [("ladder/Main", "/api/rungs", "document.querySelectorAll('.rung').length > 0"),
                              ("tags", "/api/tags", "document.querySelectorAll('main tbody tr').length > 3")]:
        look = test.look()
        look.open("overview")
        refused = []

        def refuse_once(route):
            if refused:
                route.continue_()
            else:
                refused.append(route)
                route.fulfill(status=502, json={"error": "no rungd answers"})

        look.page.route(f"**{path}?*", refuse_once)
        look.page.goto(f"{look.origin}/#{name}")
        look.until(found)
        assert refused, f"{path} was not asked for"
        look.errors = [of for of in look.errors if "status of 502" not in of]
        look.fine()


def a_late_answer_leaves_the_next_page_alone(test):
    look = test.look()
    look.open("overview")
    waiting = []
    look.page.route("**/api/tags?*", lambda route: waiting.append(route))
    look.page.goto(f"{look.origin}/#tags")
    look.until_asked(waiting, 1)
    look.open("ladder/Main")
    with look.page.expect_response("**/api/tags?*"):
        waiting[0].continue_()
    for _ in range(5):
        step_of_events(look)
    assert look.says("view.element") == "Main", "the answer about tags changed what the ladder's page watches"
    look.fine()


def a_controller_that_is_gone_is_said(test):
    look = test.look()
    look.open("ladder/Main")
    test.plant.end()
    look.until("document.querySelector('#link.error')?.textContent.includes('no rungd answers')")
    assert look.says("document.body.classList.contains('stale')")
    look.picture("gone")
    test.plant.start()
    look.until("document.querySelector('#link').textContent === 'live'"
               " && [...page.shown.places.values()].some(of => of.power !== undefined)")
    look.fine()


def a_reload_brings_the_new_rungs(test):
    look = test.look()
    look.open("ladder/Main")
    test.plant.write((LADDER + MORE).replace("level > 10", "level > 77"))
    assert "failed" not in test.plant.say("reload")
    look.until("document.querySelector('[data-rung=\"1\"]')?.textContent.includes('level > 77')")
    look.until("[...page.shown.places.values()].some(of => of.power !== undefined)")
    test.plant.write(LADDER + MORE)
    test.plant.say("reload")
    look.fine()


def another_site_neither_reads_nor_writes(test):
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Foreign)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    look = test.look()
    look.open("overview")
    # A second page in the same browser, which has the session's cookie.
    other = look.context.new_page()
    other.goto(f"http://127.0.0.1:{server.server_address[1]}/")
    answers = other.evaluate(FOREIGN, look.origin)
    assert answers == ["refused"] * len(answers), answers
    for action in ["/api/write", "/api/logout"]:
        with other.expect_navigation() as arrival:
            other.evaluate("""action => { const form = document.createElement('form');
              form.method = 'post'; form.action = action; form.enctype = 'text/plain';
              document.body.append(form); form.submit(); }""", look.origin + action)
        assert arrival.value.status == 403, arrival.value.status
        other.goto(f"http://127.0.0.1:{server.server_address[1]}/")
    other.evaluate("address => { const of = document.createElement('iframe'); of.src = address;"
                   " document.body.append(of); return new Promise(done => { of.onload = done; }); }", look.origin)
    framed = [frame.url for frame in other.frames[1:]]
    assert all("chrome-error" in url for url in framed), f"no page is put into a frame: {framed}"
    assert test.plant.value("level") != 66
    server.shutdown()
    look.fine()


FOREIGN = """async (origin) => {
  const json = { 'Content-Type': 'application/json' }, body = JSON.stringify({ operand: 'level', value: 66 });
  const tries = [
    () => fetch(origin + '/api/status', { credentials: 'include' }),
    () => fetch(origin + '/api/session', { credentials: 'include', headers: { 'X-CSRF-Token': 'x' } }),
    () => fetch(origin + '/api/write', { method: 'POST', credentials: 'include', headers: json, body }),
    () => fetch(origin + '/events?element=Main', { credentials: 'include' }),
  ];
  const answers = [];
  for (const one of tries) answers.push(await one().then(of => of.text(), () => 'refused'));
  answers.push(await new Promise(done => {
    const source = new EventSource(origin + '/events?element=Main', { withCredentials: true });
    source.onerror = () => { source.close(); done('refused'); };
    source.onmessage = of => done(of.data);
  }));
  answers.push(await fetch(origin + '/api/status', { mode: 'no-cors', credentials: 'include' })
    .then(of => of.type === 'opaque' ? 'refused' : of.text(), () => 'refused'));
  return answers;
}"""


def nothing_is_wider_than_a_narrow_screen(test):
    look = test.look(viewport={"width": 390, "height": 800})
    for name in PAGES:
        look.open(name)
        look.picture("narrow-" + name.replace("/", "-"))
        wide = look.says("document.documentElement.scrollWidth")
        assert wide <= 390, f"{name} is {wide} pixels wide"
    look.open("ladder/Main")
    look.page.locator('[data-rung="1"] g[data-name="lamp"]').first.click()
    look.until("document.querySelector('#why pre')")
    look.picture("narrow-why")
    pane = look.says("document.querySelector('#why').getBoundingClientRect().toJSON()")
    assert pane["left"] >= 0 and pane["right"] <= 390 and pane["top"] >= 0, pane
    look.fine()


# All shown elements that a mouse can operate.
USABLE = """[...document.querySelectorAll('a[href], button, input, summary, canvas[tabindex], g[data-leaf], g.coil')]
  .filter(of => !of.disabled && of.getClientRects().length)"""


def the_keyboard_alone_reaches_everything(test):
    look = test.look()
    for name in PAGES:
        look.open(name)
        look.hold() if name == "ladder/Main" else None
        look.says("document.activeElement.blur()")
        look.says(f"window.left = new Set({USABLE})")
        assert look.says("left.size") >= 7
        unseen = None
        for _ in range(400):
            look.page.keyboard.press("Tab")
            unseen = unseen or look.says(UNSEEN)
            # Tab may start anywhere in the page; after the last element it continues at the first.
            if look.says("!left.size"):
                break
        left = look.says("[...left].filter(of => of.isConnected).map(of => of.outerHTML.slice(0, 120))")
        assert not left, f"{name}: not reached: {left[:5]}"
        assert not unseen, f"{name}: the focus is not seen: {unseen}"
    # The link that skips the page's head moves the focus to the content.
    look.open("tags")
    look.page.focus("#skip")
    look.page.keyboard.press("Enter")
    assert look.says("document.activeElement.id") == "content"
    assert look.page.locator("#find").is_visible(), "the page stays"
    look.fine()


def what_has_the_focus_keeps_it(test):
    test.plant.say("write", "start", "ON")
    test.plant.say("write", "halt", "ON")
    look = test.look()
    for name, place in [("overview", "#runs a"), ("overview", "#cards button"), ("alarms", "main button")]:
        look.open(name)
        look.until("state.status && state.status.alarms.length")
        look.page.locator(place).first.focus()
        # Waits for two changes of the status, during which scans arrive too.
        look.says("window.seen = state.status")
        look.until("state.status !== seen")
        look.says("window.seen = state.status")
        look.until("state.status !== seen")
        assert look.says("place => document.activeElement.matches(place)", place), f"{name}: {place} lost the focus"
    test.plant.say("write", "halt", "OFF")
    test.plant.say("write", "start", "OFF")
    look.fine()


# Removes the focused element from the remaining ones; returns the element if its focus is not visible.
UNSEEN = """() => {
  const of = document.activeElement;
  left.delete(of);
  if (of === document.body) return null;
  const style = getComputedStyle(of), box = of.getBoundingClientRect();
  const seen = parseFloat(style.outlineWidth) >= 2 && style.outlineStyle !== 'none';
  const inside = box.bottom > 0 && box.top < innerHeight;
  return seen && inside ? null : of.outerHTML.slice(0, 120) + JSON.stringify(box);
}"""


def text_and_wires_have_contrast(test):
    test.plant.say("write", "start", "ON")
    test.plant.say("write", "halt", "ON")
    for scheme in ["light", "dark"]:
        look = test.look(color_scheme=scheme)
        look.until("page && state.status && state.status.alarms.length")
        for name in PAGES:
            look.open(name)
            look.picture(f"{scheme}-" + name.replace("/", "-"))
            low = look.says(CONTRAST)
            assert low["seen"] > 10 and not low["low"], f"{scheme} {name}: {low}"
        look.open("ladder/Main")
        look.page.locator('[data-rung="1"] g[data-name="lamp"]').first.click()
        look.until("document.querySelector('#why pre')")
        look.picture(f"{scheme}-why")
        low = look.says(CONTRAST)
        assert not low["low"], f"{scheme} why: {low}"
        look.fine()
    test.plant.say("write", "halt", "OFF")
    test.plant.say("write", "start", "OFF")


# Texts with a contrast below 4.5 and lines below 3 (WCAG 1.4.3, 1.4.11), including the opacity of their ancestors.
CONTRAST = """() => {
  const parts = text => text.match(/[\\d.]+/g).map(Number);
  const light = rgb => { const [r, g, b] = rgb.map(v => (v /= 255) <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
    return 0.2126 * r + 0.7152 * g + 0.0722 * b; };
  const over = (rgb, alpha, below) => rgb.map((v, at) => v * alpha + below[at] * (1 - alpha));
  const up = of => { const all = []; for (; of; of = of.parentElement) all.push(of); return all; };
  const low = [];
  let seen = 0;
  const judge = (of, text, wanted) => {
    const [r, g, b, a = 1] = parts(text);
    const chain = up(of), papers = chain.map(one => parts(getComputedStyle(one).backgroundColor));
    const paper = papers.find(one => (one[3] ?? 1) === 1) ?? [255, 255, 255];
    const opacity = chain.reduce((all, one) => all * Number(getComputedStyle(one).opacity), a);
    const [x, y] = [light(over([r, g, b], opacity, paper)), light(paper)];
    const ratio = (Math.max(x, y) + 0.05) / (Math.min(x, y) + 0.05);
    seen++;
    if (ratio < wanted) low.push([ratio.toFixed(2), of.outerHTML.slice(0, 90)]);
  };
  for (const of of document.querySelectorAll('body *')) {
    if (!of.getClientRects().length || of.disabled || of.closest('noscript')) continue;
    const style = getComputedStyle(of), isSvg = of instanceof SVGElement;
    const hasText = [...of.childNodes].some(one => one.nodeType === 3 && one.textContent.trim());
    if (hasText && !isSvg) judge(of, style.color, 4.5);
    if (hasText && of.tagName === 'text') judge(of, style.fill, 4.5);
    if (isSvg && style.stroke !== 'none' && !of.childElementCount) judge(of, style.stroke, 3);
    if (/^(BUTTON|INPUT)$/.test(of.tagName) && of.type !== 'range' && parseFloat(style.borderTopWidth)) judge(of, style.borderTopColor, 3);
  }
  return { seen, low: low.slice(0, 8) };
}"""


# The picture of README.md, of the shipped parts bin. Its text, with every number and state masked, is kept beside
# it: a page that reads differently needs a new picture. Pixels are not compared.
SHIPPED = os.path.join(rig.HERE, "config")
SHOWN = os.path.join(rig.HERE, "docs/pictures/page")


def masked(text):
    words = re.sub(r"\b(ON|OFF)\b", "OFF", re.sub(r"\d+|…", "0", text))
    # The time of a timer is shown as `0 ms` or `0.0 s`, by its length.
    words = re.sub(r"\b0(\.0)? m?s\b", "0 s", words)
    return re.sub(r"\s+", " ", words).strip() + "\n"


def the_picture_of_the_first_page_is_fresh(test):
    with open(os.path.join(SHIPPED, "programs/parts-bin.toml")) as file:
        ladder = file.read()
    with open(os.path.join(SHIPPED, "rungd.toml")) as file:
        controller = file.read().replace("programs/parts-bin.toml", "ladder.toml").replace('"rungd.sock"', '"s"')
    plant = Plant(ladder, controller.replace('watchdog = "200ms"', 'watchdog = "30s"'))
    pages = Pages(plant)
    try:
        look = test.look(pages, viewport={"width": 1000, "height": 640}, color_scheme="light")
        look.open("ladder/Main")
        wait_for("some parts", lambda: plant.value("parts.Acc") >= 3)
        look.hold()
        text = masked(look.says("document.querySelector('main').innerText"))
        if os.environ.get("UPDATE_PICTURES"):
            look.page.screenshot(path=SHOWN + ".png")
            with open(SHOWN + ".txt", "w") as file:
                file.write(text)
        look.picture("first-page")
        with open(SHOWN + ".txt") as file:
            shown = file.read()
        assert text == shown, f"UPDATE_PICTURES=1 makes docs/pictures/page.png anew:\n{shown}{text}"
        look.fine()
    finally:
        pages.end()
        plant.end()
        shutil.rmtree(plant.folder, ignore_errors=True)


# --- All of them ---------------------------------------------------------------------------------

CHECKS = [
    every_page_loads,
    the_lit_wires_are_those_of_the_scan,
    a_compare_shows_both_sides_and_a_call_folds_its_subroutine_out,
    scans_are_stepped_by_keys_and_buttons,
    a_click_and_enter_ask_why,
    why_leads_to_how_it_could_change,
    search_finds_a_tag,
    a_trend_is_zoomed,
    a_trend_over_hours_comes_from_the_scan_log,
    a_panel_shows_what_it_should,
    what_is_shown_of_an_output_is_what_the_device_got,
    a_user_signs_in_and_writes,
    *PANEL_CHECKS,
    *HOLD_CHECKS,
    *LIFT_CHECKS,
    *RIGHTS_CHECKS,
    nothing_is_wider_than_a_narrow_screen,
    the_keyboard_alone_reaches_everything,
    what_has_the_focus_keeps_it,
    text_and_wires_have_contrast,
    axe_core_finds_nothing_serious_on_any_page,
    another_site_neither_reads_nor_writes,
    a_late_answer_does_not_bring_an_earlier_page_back,
    a_refused_request_is_sent_again,
    a_late_answer_leaves_the_next_page_alone,
    a_controller_that_is_gone_is_said,
    a_reload_brings_the_new_rungs,
    the_picture_of_the_first_page_is_fresh,
]


class Test:
    """The browser and the controller, which all checks share."""

    def __init__(self, browser):
        self.browser = browser
        self.plant = Plant()

    def look(self, pages=None, **options):
        """A page of a browser without cookies or history. A one-time link signs it in."""
        own = pages or Pages(self.plant)
        look = Look(self.browser, own.link, **options)
        if not pages:
            self.pages.append(own)
        return look

    def run(self, check):
        self.pages = []
        try:
            check(self)
            return True
        except Exception as error:  # Playwright's errors too: the next check still runs
            print(f"  {type(error).__name__}: {error}")
            if self.plant.process.poll() is not None:
                print(f"  the controller has ended: {self.plant.last_line()}")
            for number, page in enumerate(of for context in self.browser.contexts for of in context.pages):
                rig.tell(page, f"failed-{check.__name__}-{number}")
            return False
        finally:
            for pages in self.pages:
                pages.end()
            for context in self.browser.contexts:
                context.close()


def main():
    words = sys.argv[1:]
    if words and os.access(words[0], os.X_OK):
        rig.RUNGD = os.path.abspath(words.pop(0))
    if not os.access(rig.RUNGD, os.X_OK):
        sys.exit(f"no {rig.RUNGD}: cargo build --release, or set RUNGD")
    path, sync_playwright = rig.chromium()
    os.makedirs(PICTURES, exist_ok=True)
    failed = 0
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        test = Test(browser)
        try:
            for check in CHECKS:
                if words and not any(word in check.__name__ for word in words):
                    continue
                is_right = test.run(check)
                print(f"{'ok    ' if is_right else 'FAILED'} {check.__name__.replace('_', ' ')}", flush=True)
                failed += not is_right
        finally:
            test.plant.end()
            shutil.rmtree(test.plant.folder, ignore_errors=True)
            browser.close()
    print(f"{failed} failed; the pictures are in {PICTURES}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
