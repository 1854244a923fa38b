"""`ab-sim effects NAME --equation`."""

from tests.cli.tool import ab_sim


def test_an_effect_is_printed_from_its_code() -> None:
    shown = ab_sim("effects", "suspension", "--equation")
    assert shown.returncode == 0, shown.stderr
    for line in (
        "suspension",
        "  deck_force: force on the deck [N], on axes that turn with the rotor",
        "    f_1 = -c v_1 - k u_1",
        "    k is stiffness, c is damping",
        r"    f_{1} = -c \, v_{1} - k \, u_{1}",
    ):
        assert line in shown.stdout.splitlines()


def test_all_are_printed_without_a_name() -> None:
    shown = ab_sim("effects", "--equation").stdout.splitlines()
    assert {"motor", "race_runout", "viscous_drag"} <= set(shown)
    assert "      with c = cos(axis_angle)" in shown


def test_a_name_that_is_none_gets_the_nearest() -> None:
    shown = ab_sim("effects", "suspenson", "--equation")
    assert shown.returncode == 2
    assert "no such effect; did you mean 'suspension'?" in shown.stderr
