import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from rom.interactive import wire

ARRAYS = st.sampled_from(["<f4", "<f8", "<u4", "|u1"]).flatmap(
    lambda kind: hnp.arrays(np.dtype(kind), hnp.array_shapes(min_dims=1, max_dims=3, min_side=0, max_side=5)))


@given(st.dictionaries(st.text("abcxyz_", min_size=1, max_size=8), ARRAYS, max_size=4),
       st.dictionaries(st.text(max_size=5).filter(lambda key: key != "arrays"), st.text(max_size=20), max_size=4))
def test_a_message_comes_back_as_it_was(arrays, header):
    message = wire.encode(header, arrays)
    found, back = wire.decode(message)
    assert found == header
    assert list(back) == list(arrays)
    for name, array in arrays.items():
        np.testing.assert_array_equal(back[name], array)
        assert back[name].dtype == array.dtype


def test_arrays_begin_at_multiples_of_eight():
    message = wire.encode({"a": "b"}, {"one": np.zeros(3, "u1"), "two": np.ones(5, "f8"), "three": np.ones(1, "f4")})
    length = int.from_bytes(message[:4], "little")
    assert (4 + length) % 8 == 0
    assert [one["offset"] % 8 for one in json.loads(message[4:4 + length])["arrays"]] == [0, 0, 0]
    assert len(message) % 8 == 0


def test_a_reply_never_holds_what_json_does_not_know():
    with pytest.raises(ValueError, match="JSON compliant"):
        wire.encode({"residual": float("nan")})
    with pytest.raises(ValueError, match="of type int64"):
        wire.encode({}, {"one": np.arange(3)})


@pytest.mark.parametrize("text", [
    "", "{", "[]", "3", "null", '"x"', "{}", '{"id": 1}', '{"ask": "field"}', '{"id": true, "ask": "field"}',
    '{"id": -1, "ask": "field"}', '{"id": 1.5, "ask": "field"}', '{"id": 1, "ask": 3}', '{"id": NaN, "ask": "field"}',
    '{"id": 1, "ask": "field", "state": {"frequency": Infinity}}', '{"id": 1' + "0" * 5000 + ', "ask": "x"}',
    "[" * 16000, '{"id":' * 2000, "\x00", '{"id": 9007199254740993, "ask": "field"}'])
def test_what_is_no_request_is_refused_in_one_sentence(text):
    with pytest.raises(ValueError) as refusal:
        wire.parse_request(text)
    assert "\n" not in str(refusal.value)
    assert len(str(refusal.value)) < 200


@given(st.text(max_size=300))
def test_any_text_is_parsed_or_refused(text):
    try:
        request = wire.parse_request(text)
    except ValueError:
        return
    assert isinstance(request["id"], int)
