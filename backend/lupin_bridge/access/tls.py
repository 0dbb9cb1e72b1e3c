"""The certificate and its key: looked at before anything starts, and again when they change."""

from __future__ import annotations

import asyncio
import logging
import os
import ssl
from typing import Final, NoReturn

from lupin_bridge.settings import SettingError

log = logging.getLogger(__name__)

# How often the files are looked at. Certificates are renewed weeks before they end.
WATCH_PERIOD_S: Final = 2.0


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


class Certificates:
    """A pair that is served, and follows its files: who connects later gets what they hold by then.

    Connections that are open keep what they have. A new pair that cannot be served is told once,
    and the old one goes on until the files hold one that can.
    """

    def __init__(self, cert_file: str, key_file: str, context: ssl.SSLContext) -> None:
        self._files = (cert_file, key_file)
        self._context = context
        self._served = self._version()
        self._told = ""

    async def watch(self) -> NoReturn:
        """Look at the files now and then, for ever."""
        while True:
            await asyncio.sleep(WATCH_PERIOD_S)
            self.look()

    def look(self) -> None:
        """Serve what the files hold, if that is something else by now and will do."""
        version = self._version()
        if version == self._served:
            return
        try:
            # Not into the live context: a pair that is none would leave it with neither.
            check_pair(*self._files)
            self._context.load_cert_chain(*self._files)
        except (TlsError, OSError) as error:  # ssl.SSLError is an OSError
            if str(error) != self._told:
                log.warning("the new TLS certificate is refused, the old one goes on: %s", error)
            self._told = str(error)
            return
        self._served, self._told = version, ""
        log.info("new connections get the TLS certificate of %s as it is now", self._files[0])

    def _version(self) -> list[tuple[int, ...] | None]:
        return [_stamp(path) for path in self._files]


def _stamp(path: str) -> tuple[int, ...] | None:
    try:
        status = os.stat(path)  # noqa: PTH116  # through links, as renewals are made
    except OSError:
        return None
    return status.st_mtime_ns, status.st_ino, status.st_size
