"""Certificates made for a test, and clients that trust them."""

import ssl
from dataclasses import dataclass
from pathlib import Path

import trustme


@dataclass(frozen=True)
class Certificate:
    """A certificate and its key as files, and what a client needs to trust it."""

    cert: Path
    key: Path
    trust: ssl.SSLContext
    authority: trustme.CA

    @property
    def options(self) -> tuple[str, ...]:
        return ("--tls-cert", str(self.cert), "--tls-key", str(self.key))


def certificate(folder: Path, name: str = "server") -> Certificate:
    """A certificate for this machine's loopback names, signed by an authority of its own."""
    authority = trustme.CA()
    issued = authority.issue_cert("127.0.0.1", "localhost")
    cert, key = folder / f"{name}.crt", folder / f"{name}.key"
    issued.private_key_pem.write_to_path(str(key))
    for blob in issued.cert_chain_pems:
        blob.write_to_path(str(cert), append=True)
    trust = ssl.create_default_context()
    authority.configure_trust(trust)
    return Certificate(cert, key, trust, authority)
