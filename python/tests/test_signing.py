"""Signed messages: who signed them, and verdicts that equal the program's."""

from pathlib import Path

import numpy as np
import pytest
from signers import write_key

import vocc

MESSAGE = "Ice"
KEYS = ("verdict", "signer", "signer_name", "counter")


@pytest.fixture(scope="module")
def keys(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two private keys, and the files that trust each."""
    folder = tmp_path_factory.mktemp("keys")
    for name in ("truck", "other"):
        write_key(folder / f"{name}.toml", folder / f"{name}-public.toml", name)
    return folder


@pytest.fixture(scope="module")
def renderer() -> vocc.Renderer:
    return vocc.Renderer("paper", level="fast", crop=True)


def film(renderer: vocc.Renderer, key: Path | None, counter: int | None = None) -> list[np.ndarray]:
    """A message, repeated twice; the panels after it end its last symbol."""
    once = vocc.transmit(MESSAGE, sign=key, counter=counter)
    return [renderer.render(bits) for bits in vocc.transmit(MESSAGE, count=2 * len(once) + 2, sign=key, counter=counter)]


def received(images: list[np.ndarray], **settings: object) -> tuple[list[vocc.Message], list[vocc.Proof]]:
    receiver = vocc.Receiver(symbol_rate=100, **settings)
    messages: list[vocc.Message] = []
    proofs: list[vocc.Proof] = []
    for image in images:
        got = receiver.feed(image)
        messages += got.messages
        proofs += got.proofs
    messages += receiver.finish()
    proofs += receiver.proofs
    return messages, proofs


def verdicts(images: list[np.ndarray], **settings: object) -> list[tuple[str, int | None]]:
    _, proofs = received(images, **settings)
    assert all((proof.text, proof.data, proof.panel) == (MESSAGE, MESSAGE.encode(), 0) for proof in proofs)
    return [(proof.verdict, proof.counter) for proof in proofs]


def test_signed_panels_are_the_programs(keys: Path, vocc_json) -> None:
    printed = vocc_json("transmit", "--message", MESSAGE, "--sign", keys / "truck.toml", "--counter", 5)
    panels = [vocc.as_hex(bits) for bits in vocc.transmit(MESSAGE, sign=keys / "truck.toml", counter=5)]
    assert panels == [row["panel"] for row in printed]
    assert len(panels) == len(vocc.transmit(MESSAGE)) + 20


def test_a_signed_message_is_proven_and_its_signer_named(keys: Path, renderer: vocc.Renderer, vocc_json) -> None:
    [shown] = vocc_json("keys", "show", keys / "truck.toml")
    images = film(renderer, keys / "truck.toml", 41)
    messages, proofs = received(images, trust=keys / "truck-public.toml")
    assert [(message.text, message.verdict, message.signer, message.counter) for message in messages] == [(MESSAGE, "unproven", None, None)]
    assert [[getattr(proof, key) for key in KEYS] for proof in proofs] == [["proven", shown["signer"], "truck", 41]]

    [message], proofs = received(images, trust=str(keys / "truck-public.toml"), only_trusted=True)
    assert [getattr(message, key) for key in KEYS] == ["proven", shown["signer"], "truck", 41]
    assert (message.text, message.first_frame, proofs) == (MESSAGE, 0, [])
    assert [message.verdict for message in vocc.receive(images, symbol_rate=100, trust=keys / "truck-public.toml", only_trusted=True)] == [
        "proven"
    ]


def test_nothing_else_is_proven(keys: Path, renderer: vocc.Renderer) -> None:
    signed, unsigned = film(renderer, keys / "truck.toml", 41), film(renderer, None)
    trust = keys / "other-public.toml"
    assert verdicts(signed, trust=trust) == [("unknown", 41)]
    assert verdicts(unsigned, trust=trust) == [("unsigned", None)]
    assert received(unsigned, trust=trust, only_trusted=True)[0] == []
    # Without keys, the signer is named and nothing is proven.
    [proof] = received(signed)[1]
    assert (proof.verdict, proof.signer_name, proof.counter) == ("unchecked", None, 41)
    assert proof.signer is not None and len(proof.signer) == 8
    assert verdicts(unsigned) == [("unsigned", None)]


def test_a_film_shown_again_is_replayed_as_far_as_counters_are_kept(keys: Path, renderer: vocc.Renderer, tmp_path: Path) -> None:
    trust, counters = keys / "truck-public.toml", tmp_path / "seen.toml"
    first, second = (film(renderer, keys / "truck.toml", counter) for counter in (41, 42))
    assert verdicts(first + second, trust=trust) == [("proven", 41), ("proven", 42)]
    assert verdicts(first, trust=trust, counters=counters) == [("proven", 41)]
    assert verdicts(first, trust=trust, counters=counters) == [("replayed", 41)]
    assert verdicts(second, trust=trust, counters=counters) == [("proven", 42)]
    assert counters.read_text().endswith("= 42\n")
    assert [path.name for path in tmp_path.iterdir()] == ["seen.toml"]


def test_counters_that_cannot_be_written_are_a_warning(keys: Path, renderer: vocc.Renderer, tmp_path: Path) -> None:
    counters = tmp_path / "none" / "seen.toml"
    with pytest.warns(UserWarning, match=r"cannot write .*seen\.toml.*not kept"):
        assert verdicts(film(renderer, keys / "truck.toml", 7), trust=keys / "truck-public.toml", counters=counters) == [("proven", 7)]


def test_files_and_settings_that_do_not_fit_are_refused(keys: Path, tmp_path: Path) -> None:
    public, private = keys / "truck-public.toml", keys / "truck.toml"
    bad = tmp_path / "bad.toml"
    bad.write_text("[[key]]\nname = 'a'\npublic = '12'\n")
    for settings, words in [
        ({"trust": tmp_path / "none.toml"}, "cannot read"),
        ({"trust": private}, "holds a private key"),
        ({"trust": bad}, "64 hexadecimal digits"),
        ({"trust": public, "counters": public}, "holds no counters"),
        ({"counters": tmp_path / "seen.toml"}, "give trust"),
        ({"only_trusted": True}, "give trust"),
    ]:
        with pytest.raises(vocc.VoccError, match=words):
            vocc.Receiver(**settings)
    for settings, words in [
        ({"sign": public}, "holds no private key"),
        ({"sign": private, "raw": True}, "leave out raw or sign"),
        ({"counter": 3}, "give sign"),
    ]:
        with pytest.raises(vocc.VoccError, match=words):
            vocc.transmit(MESSAGE, **settings)
    with pytest.raises(OverflowError):
        vocc.transmit(MESSAGE, sign=private, counter=-1)
