"""Framing: intact frames are found whatever surrounds them, and damage is counted once."""

from collections import Counter
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect
from vehicle_frames import Vehicle

from bridge.mavlink_frames import MAX_FRAME, Framer


def frames_in(*chunks: bytes) -> tuple[list[bytes], Counter[str]]:
    counts: Counter[str] = Counter()
    framer = Framer(counts)
    return [frame.payload for chunk in chunks for frame in framer.feed(chunk)], counts


@pytest.fixture(params=[False, True], ids=["mavlink2", "mavlink1"])
def stream(request: pytest.FixtureRequest) -> list[bytes]:
    """200 frames whose payloads hold markers of their own."""
    vehicle = Vehicle(mavlink1=request.param)
    return [vehicle.attitude(0xFD00FE + 0xFD * k, pitch=0.001 * k) for k in range(200)]


def test_whole_and_byte_by_byte_give_the_same_frames(stream: list[bytes]) -> None:
    raw = b"".join(stream)
    whole, counts = frames_in(raw)
    assert len(whole) == 200
    assert not counts
    assert frames_in(*(raw[k : k + 1] for k in range(len(raw))))[0] == whole


@given(cuts=st.lists(st.integers(0, 4000), max_size=20), garbage=st.binary(max_size=300))
@settings(max_examples=40, deadline=None)
def test_any_split_after_garbage_gives_the_same_frames(cuts: list[int], garbage: bytes) -> None:
    vehicle = Vehicle()
    # Frames enough to complete whatever the garbage seems to begin.
    raw = garbage + b"".join(vehicle.attitude(1000 + k) for k in range(80))
    edges = [0, *sorted(cuts), len(raw)]
    split, _ = frames_in(*(raw[a:b] for a, b in pairwise(edges)))
    whole, _ = frames_in(raw)
    assert split == whole
    assert len(whole) >= 80


def test_stray_marker_every_ten_frames_loses_nothing(stream: list[bytes]) -> None:
    for stray in (b"\xfd", b"\xfe"):
        raw = b"".join(frame + stray * (k % 10 == 0) for k, frame in enumerate(stream))
        # 300 bytes let the last stray marker's claimed frame be judged.
        assert len(frames_in(raw, bytes(300))[0]) == 200


def test_pymavlink_parser_loses_frames_where_ours_does_not(stream: list[bytes]) -> None:
    raw = b"".join(frame + b"\xfd" * (k % 10 == 0) for k, frame in enumerate(stream))
    parser = dialect.MAVLink(None)
    parser.robust_parsing = True
    theirs = [m for m in parser.parse_buffer(raw) or [] if m.get_type() == "ATTITUDE"]
    assert len(theirs) < 150
    assert len(frames_in(raw)[0]) >= 199


def test_boot_text_between_frames_costs_only_itself(stream: list[bytes]) -> None:
    text = b"\r\nArduSub V4.7.0-dev init\r\nFree RAM: 123456\r\n"
    found, counts = frames_in(text.join(stream))
    assert len(found) == 200
    assert counts == {"refused.bytes": 199 * len(text)}


def test_damaged_frame_is_counted_once_and_the_next_found() -> None:
    vehicle = Vehicle()
    damaged = bytearray(vehicle.attitude(1000))
    damaged[15] ^= 1
    found, counts = frames_in(bytes(damaged) + vehicle.attitude(1100))
    assert len(found) == 1
    assert counts["refused.crc"] == 1
    assert counts["refused.bytes"] == len(damaged)


def test_frame_of_unknown_id_is_refused_and_counted() -> None:
    vehicle = Vehicle()
    unknown = bytearray(vehicle.attitude(1000))
    unknown[7:10] = (60_000).to_bytes(3, "little")
    found, counts = frames_in(bytes(unknown) + vehicle.attitude(1100))
    assert len(found) == 1
    assert counts["refused.unknown_id"] == 1


def test_frame_cut_by_the_next_one_does_not_hide_it() -> None:
    vehicle = Vehicle()
    cut = vehicle.attitude(1000)[:20]
    found, counts = frames_in(cut + vehicle.attitude(1100) + vehicle.attitude(1200))
    assert len(found) == 2
    assert counts["refused.crc"] == 1


def test_signed_frames_are_read() -> None:
    sender = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    sender.signing.secret_key = bytes(32)
    sender.signing.sign_outgoing = True
    raw = bytes(dialect.MAVLink_attitude_message(1000, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0).pack(sender))
    framer = Framer(Counter())
    (first, second) = framer.feed(raw + Vehicle().attitude(1100))
    assert first.signed
    assert not second.signed


def test_payload_of_a_newer_dialect_is_read() -> None:
    """MAVLink 2 lets messages grow at the end; the checksum stays that of the fields known to all."""
    sender = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    message = dialect.MAVLink_attitude_message(1000, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0)
    payload = message.unpacker.pack(1000, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0) + b"\x01\x02"
    raw = bytes(message._pack(sender, message.crc_extra, payload))
    assert len(frames_in(raw)[0]) == 1


@given(chunks=st.lists(st.binary(max_size=600), max_size=20), marker=st.sampled_from([b"", b"\xfd", b"\xfe"]))
@settings(max_examples=150, deadline=None)
def test_random_bytes_never_raise_and_leave_at_most_one_frame_buffered(
    chunks: list[bytes], marker: bytes
) -> None:
    framer = Framer(Counter())
    for chunk in chunks:
        framer.feed(marker + chunk)
        assert len(framer._buffer) < MAX_FRAME


@given(data=st.lists(st.sampled_from([b"\xfd", b"\xfe", b"\x00", b"\x01", b"\x1e", b"\x1c"]), max_size=2000))
@settings(max_examples=100, deadline=None)
def test_streams_of_markers_never_raise_and_stay_bounded(data: list[bytes]) -> None:
    framer = Framer(Counter())
    framer.feed(b"".join(data))
    assert len(framer._buffer) < MAX_FRAME
