"""The certificate and its key, looked at before anything starts."""

from __future__ import annotations

import ssl
from typing import NoReturn

from lupin_bridge.settings import SettingError


class TlsError(SettingError):
    """A certificate or key that cannot be served; the message names the option and the file."""


def check_pair(cert_file: str, key_file: str) -> None:
    """Load a certificate chain and its private key, both PEM, and forget them again.

    Raises:
        TlsError: a file that cannot be read or is not what it should be, or a pair that is none.

    """
    for option, path in (("--tls-cert", cert_file), ("--tls-key", key_file)):
        try:
            with open(path, "rb"):  # noqa: PTH123  # read rights, whatever kind of file it is
                pass
        except OSError as error:
            raise TlsError(f"{option} {path}: {error.strerror}") from None

    def no_password() -> NoReturn:
        # Without this, OpenSSL would ask the terminal.
        raise TlsError(f"--tls-key {key_file} is encrypted: give a key without a passphrase")

    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    try:
        context.load_verify_locations(cert_file)
    except ssl.SSLError:
        raise TlsError(f"--tls-cert {cert_file} holds no PEM certificate") from None
    try:
        context.load_cert_chain(cert_file, key_file, no_password)
    except ssl.SSLError as error:
        if error.reason == "KEY_VALUES_MISMATCH":
            raise TlsError(f"--tls-key {key_file} is not the key of {cert_file}") from None
        reason = error.reason or "not PEM"
        raise TlsError(f"--tls-key {key_file} is no usable private key ({reason})") from None
