"""Keys that are always the same, because signatures decide which panels a camera sees."""

from pathlib import Path

# By name: the public and the private half.
KEYS = {
    "truck": (
        "80bafe5ab9dbbb0958760954b8d6019c1f16aa6caf9eed2ba533caececea7e4e",
        "76a9b3af16eff1491fa7489351e3199f245aed57af308c2ed9c3f6741e24967f",
    ),
    "other": (
        "8e8e228fe722cf315dfe0608807f5a6d965a0171a9181edc75b623e659620ab4",
        "c8c3de781c2ecd6e8e8f6742655b5bf6b77786da88618b94b0a110f4ddabb98f",
    ),
}


def write_key(key: Path, trust: Path, name: str) -> None:
    """Writes a private key, which only its owner may read, and a file that trusts it."""
    public, secret = KEYS[name]
    public = f'name = "{name}"\npublic = "{public}"\n'
    trust.write_text(f"[[key]]\n{public}")
    key.touch(mode=0o600)
    key.write_text(f'{public}secret = "{secret}"\n')
