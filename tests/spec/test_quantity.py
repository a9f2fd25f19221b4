"""Quantities: one parser, one table of units, for everything that is asked for."""

import math

import msgspec
import pytest

from mracad.errors import UsageError
from mracad.spec.fields import fields
from mracad.spec.quantity import ANGLE, LENGTH, MEMORY, MILLIMETRES, SHARE, TIME, length
from mracad.spec.steps import STEPS, Check, Compare, Extract, Repeat, Smooth
from mracad.spec.text import options


@pytest.mark.parametrize(
    ("kind", "text", "value"),
    [
        (LENGTH, "5", 5.0),
        (LENGTH, " 0.2in ", 5.08),
        (TIME, "90", 90.0),
        (TIME, "10min", 600.0),
        (TIME, "2h", 7200.0),
        (MEMORY, "500MB", 5e8),
        (MEMORY, "1.5GiB", 1.5 * 2**30),
        (MEMORY, "2g", 2e9),
        (ANGLE, "-3", -3.0),
        (ANGLE, "0.5deg", 0.5),
        (ANGLE, "30°", 30.0),
        (ANGLE, f"{math.pi}rad", 180.0),
        (SHARE, "1%", 1.0),
    ],
)
def test_a_quantity_is_its_number_times_its_unit(kind, text, value):
    assert kind.read(text, "x") == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize("unit", MILLIMETRES)
def test_every_unit_of_length_and_the_share_of_a_model(unit):
    assert length(f"3{unit}", 1.0, "x") == 3 * MILLIMETRES[unit]
    assert length("2%", 50.0, "x") == 1.0


@pytest.mark.parametrize(
    ("kind", "text"),
    [(LENGTH, "2%"), (LENGTH, "5s"), (TIME, "5mm"), (TIME, "inf"), (ANGLE, "3mm"), (LENGTH, "")],
)
def test_what_is_no_such_quantity_is_refused_with_how_to_write_it(kind, text):
    with pytest.raises(UsageError, match=f"is not {kind.noun}") as error:
        kind.read(text, "x")
    assert kind.example in error.value.hint


@pytest.mark.parametrize(("kind", "text"), [(LENGTH, "1e100"), (TIME, "1e300"), (MEMORY, "9" * 300)])
def test_what_no_computation_could_take_is_too_large(kind, text):
    with pytest.raises(UsageError, match=f"too large for {kind.noun}"):
        kind.read(text, "x")


@pytest.mark.parametrize("kind", [LENGTH, TIME, MEMORY])
def test_nothing_is_no_length_time_or_memory(kind):
    for text in ("0", "-1"):
        with pytest.raises(UsageError, match="not greater than zero"):
            kind.read(text, "x")


def test_options_take_quantities_as_numbers_and_as_texts_with_their_units():
    found = options(Check, {"max-angle": "0.5deg", "kink": 2, "layer_limit": "2min", "max-gap": 0.01})
    assert (found.max_angle, found.kink, found.layer_limit, found.max_gap) == (0.5, 2.0, 120.0, "0.01")
    assert options(Compare, {"max-volume-change": "3%"}).max_volume_change == 3.0


@pytest.mark.parametrize(
    ("struct", "values", "says"),
    [
        (Smooth, {"level": 0.0}, "level: 0 is not greater than zero"),
        (Smooth, {"level": math.inf}, "level: inf is not greater than zero"),
        (Smooth, {"scale": "1mm", "amount": 1.5}, "amount: 1.5 is not between 0 and 1"),
        (Smooth, {"scale": "1mm", "amount": math.nan}, "amount: nan is not between 0 and 1"),
        (Check, {"kink": -1.0}, "kink: -1 is not 0 or more"),
        (Repeat, {"feature": "near:0,0,0,radius:1", "at": ("1,2,3",), "spin": 400.0}, "spin: 400 is not between"),
    ],
)
def test_bounds_are_those_of_the_declaration_in_python_and_in_recipes(struct, values, says):
    for make in (lambda: struct(**values), lambda: options(struct, values)):
        with pytest.raises(UsageError, match=says):
            make()


def test_hints_name_the_command_that_takes_the_option():
    assert {field.hint for field in fields(Extract).values()} == {"see mracad feature extract --help"}


@pytest.mark.parametrize("use", STEPS)
def test_every_field_has_help_and_takes_its_default(use):
    for field in fields(STEPS[use]).values():
        assert field.help and field.owner == use
        if field.default not in (None, msgspec.NODEFAULT):
            assert field.read(field.default) == field.default


@pytest.mark.parametrize(("text", "value"), [(".5", 0.5), ("1.", 1.0), ("+1", 1.0), (".05e1", 0.5)])
def test_numbers_are_read_as_people_write_them(text, value):
    assert fields(STEPS["sweep"])["amount"].read(text) == value


@pytest.mark.parametrize("text", ["", ".", "0,5", "5mm", "half"])
def test_what_is_no_number_is_named(text):
    with pytest.raises(UsageError, match=r"amount: .* is not a number"):
        fields(STEPS["sweep"])["amount"].read(text)
