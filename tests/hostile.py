"""What nobody should hand to a program and somebody will: values for property-based tests."""

import datetime

import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

settings.register_profile("hostile", derandomize=True, deadline=None, print_blob=False, suppress_health_check=[
    HealthCheck.too_slow, HealthCheck.function_scoped_fixture, HealthCheck.data_too_large])
HOSTILE = settings.get_profile("hostile")
"""The same examples in every run, so that a failure is a failure of the code and not of the day."""

EXTREME = [0.0, -0.0, -1.0, 5e-324, 1e-320, -1e-300, 1e-16, 1e16, 1e154, 1e200, 1e308, -1.7e308, 10**400, -(2**63),
           2**64, 2.0, np.nan, np.inf, -np.inf]

numbers = st.one_of(
    st.sampled_from(EXTREME), st.floats(allow_nan=True, allow_infinity=True), st.integers(),
    st.sampled_from([np.float32(0.5), np.float64("nan"), np.int8(3), np.uint64(2**63), np.float16(1.0), np.bool_(True),
                     np.longdouble("1e4000"), np.complex128(1j)]))
things = st.one_of(
    numbers, st.text(max_size=6), st.none(), st.booleans(), st.complex_numbers(), st.binary(max_size=3),
    st.lists(st.integers(), max_size=3), st.dictionaries(st.text(max_size=2), st.integers(), max_size=2),
    st.sampled_from([np.array(1.0), np.array([1.0]), np.zeros(0), np.array("a"), np.array([None]), object(), float,
                     np.datetime64("2020-01-01"), datetime.timedelta(1), {1, 2}, range(3), ...]))
"""Values of every kind, most of them wrong in any place."""

words = st.one_of(
    st.text(alphabet=st.characters(exclude_categories=("Cs",)), max_size=12),
    st.sampled_from(["", " ", "-", "--", "--help=x", "\n", "\0", "a\nb", "nan", "inf", "-inf", "1e308", "1e-320", "-1",
                     "0", "1.5", "9" * 400, "0x10", "1_0", "٣", "é", "../..", "/", "/dev/null/x", "x" * 5000, "%s%n",
                     "{}", "None", "true", "[]", "=", "a=b=c", "--preset", "-h5"]))
"""Words of a command line; no surrogates, which no terminal can send through a test's captured output."""


def one_line(error):
    """The message of an error, which must be one sentence on one line."""
    text = str(error)
    assert text.strip() and "\n" not in text, repr(text)
    return text


def refuses_or_makes(make, *errors):
    """What ``make()`` returns, or None where it raised one of ``errors`` with one line; anything else fails."""
    try:
        return make()
    except errors as error:
        one_line(error)
        return None
