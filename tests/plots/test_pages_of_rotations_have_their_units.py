"""A replay page shows in every tab what turns in rad and Nm, and what slides in m and N."""

from __future__ import annotations

from pathlib import Path

import pytest

from gms_fsm.app.scenario import load_scenario
from plots.page.replay import write_replay
from tests.app.test_rotations_show_their_own_units import MASS, TORQUE, units_in
from tests.plots.browser import Open, browser, open_page, open_tab, until

__all__ = ["browser", "open_page"]
pytestmark = pytest.mark.slow
TABS = ("Chart", "Transitions", "Bristles", "Time", "Phase", "Landscape", "Microscope")


def texts(open_page: Open, path: Path) -> str:
    """Return all that stands on a page at a row in the middle of its run, in all tabs."""
    page = open_page(path)
    until(page, "t > 0.6")
    said = []
    for tab in TABS:
        open_tab(page, tab)
        said.append(page.evaluate("document.body.innerText"))
        said += page.locator("svg text").all_text_contents()
    return "\n".join(said)


def test_of_a_joint_there_are_units_of_rotations_only(open_page: Open, tmp_path: Path) -> None:
    trace = load_scenario("robot_joint", ["run.t_end=1.2"]).simulate()
    said = texts(open_page, write_replay(tmp_path / "page.html", trace, title="a joint"))
    assert units_in(said, MASS) == set()
    assert units_in(said, TORQUE) >= {"rad", "rad/s", "Nm"}


@pytest.mark.matrix
def test_of_a_ball_screw_each_contact_has_its_own(open_page: Open, tmp_path: Path) -> None:
    run = load_scenario("ball_screw_table", ["run.t_end=1.2"]).simulate()
    for name, own, other in (("bearing", TORQUE, MASS), ("guide", MASS, TORQUE)):
        path = write_replay(tmp_path / f"{name}.html", run.contact(name), title=name)
        said = texts(open_page, path)
        assert units_in(said, own) != set() == units_in(said, other)
