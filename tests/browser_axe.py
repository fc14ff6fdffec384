"""Accessibility of every page: axe-core's findings, a check for tests/browser.py.

Each page is judged at desktop, tablet and phone size, in light and in dark colours; a picture of each is kept in
target/browser/. What axe-core calls serious or critical fails. axe-core is of npm, in the folder of Python's own
environment (.ci/setup installs it); without it the check is skipped, which CI does not permit.
"""

import os
import sys

from browser_rig import PAGES

AXE = os.path.join(sys.prefix, "npm/node_modules/axe-core/axe.min.js")
SIZES = {
    "desktop": {"viewport": {"width": 1280, "height": 800}},
    "tablet": {"viewport": {"width": 1024, "height": 768}, "has_touch": True},
    "phone": {"viewport": {"width": 390, "height": 844}, "has_touch": True, "device_scale_factor": 2},
}
BAD = ("serious", "critical")


def judged(look):
    """The serious findings on what a page shows now: `rule: place`."""
    found = look.says("""async () => (await axe.run(document, { resultTypes: ['violations'] })).violations
        .flatMap(of => of.nodes.map(node => [of.impact, of.id, node.target.join(' '), node.failureSummary]))""")
    return [f"{impact} {rule}: {place}: {why}" for impact, rule, place, why in found if impact in BAD]


def axe_core_finds_nothing_serious_on_any_page(test):
    if not os.path.exists(AXE):
        missing = f"axe-core is not in {AXE}: npm install --prefix {sys.prefix}/npm axe-core"
        assert "programs" not in os.environ.get("RUNGD_REQUIRE", "").split(), missing
        print(f"  NOT JUDGED: {missing}")
        return
    with open(AXE) as file:
        source = file.read()
    test.plant.say("write", "halt", "ON")
    test.plant.say("write", "start", "ON")
    found = {}
    for size, options in SIZES.items():
        for colours in ["light", "dark"]:
            look = test.look(color_scheme=colours, **options)
            look.says(source + "; 0")
            for name in [*PAGES, "why"]:
                if name == "why":
                    look.open("ladder/Main")
                    look.says("why('horn')")
                    look.until("document.querySelector('#why pre')")
                else:
                    look.open(name)
                look.picture(f"{size}-{colours}-{name.replace('/', '-')}")
                for finding in judged(look):
                    found.setdefault(finding, f"{size}, {colours}, {name}")
            look.fine()
    for name in ["halt", "start"]:
        test.plant.say("write", name, "OFF")
    assert not found, "\n".join(f"{where}: {what}" for what, where in found.items())
