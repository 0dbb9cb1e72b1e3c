"""The broker's client: a thread of paho's hands over what comes, the node's thread takes it."""

from __future__ import annotations

import secrets
import ssl
from collections import deque
from collections.abc import Callable
from typing import Any, Final

from lupin_twin.adapt.mqtt_topics import MAX_PAYLOAD_BYTES, Broker
from lupin_twin.adapt.table import ConfigError

# Messages that wait for the node's thread; of more, the oldest is lost and counted. All of them
# at their largest take 65 MB.
MAX_WAITING: Final = 1_000
RETRY_S: Final = (1, 60)


class MqttClient:
    """Listens to a broker; it connects, and connects again, by itself.

    `wake` is called from paho's thread when something waits.

    Raises:
        ConfigError: the library is not installed, or a certificate cannot be read.

    """

    def __init__(self, broker: Broker, wake: Callable[[], None]) -> None:
        try:
            from paho.mqtt.client import Client  # noqa: PLC0415  # for who has a broker
            from paho.mqtt.enums import CallbackAPIVersion  # noqa: PLC0415
        except ImportError:
            raise ConfigError(
                "mqtt: the package paho-mqtt is not installed here: "
                "pip install 'paho-mqtt>=2', or on a robot a virtual environment with it"
            ) from None
        self._broker = broker
        self._wake = wake
        self._waiting: deque[Any] = deque(maxlen=MAX_WAITING)
        self.lost = 0
        self.problem = f"not connected to {broker.host}:{broker.port} yet"
        self._client: Any = Client(
            CallbackAPIVersion.VERSION2, client_id=f"lupin-adapt-{secrets.token_hex(6)}"
        )
        if broker.user:
            self._client.username_pw_set(broker.user, broker.password or None)
        if broker.is_tls:
            try:
                self._client.tls_set_context(ssl.create_default_context(cafile=broker.ca or None))
            except (ssl.SSLError, OSError) as error:
                raise ConfigError(f"mqtt.ca {broker.ca}: {error.strerror or error}") from None
        self._client.reconnect_delay_set(*RETRY_S)
        self._client.on_connect = self._on_connect
        self._client.on_disconnect = self._on_disconnect
        self._client.on_connect_fail = self._on_connect_fail
        self._client.on_message = self._on_message

    def start(self) -> None:
        """Connect, in a thread of its own."""
        self._client.connect_async(self._broker.host, self._broker.port)
        self._client.loop_start()

    def stop(self) -> None:
        """End the connection and the thread."""
        self._client.disconnect()
        self._client.loop_stop()

    def take(self) -> list[Any]:
        """What has come since the last call, in order: messages as paho has them."""
        return [self._waiting.popleft() for _ in range(len(self._waiting))]

    def _on_connect(
        self, client: Any, _data: Any, _flags: Any, code: Any, _properties: Any
    ) -> None:
        if code.is_failure:
            self.problem = f"{self._broker.host}:{self._broker.port} refuses us: {code}"
            return
        self.problem = ""
        client.subscribe([(pattern.filter, 1) for pattern in self._broker.patterns])

    def _on_connect_fail(self, _client: Any, _data: Any) -> None:
        self.problem = f"nobody answers at {self._broker.host}:{self._broker.port}"

    def _on_disconnect(
        self, _client: Any, _data: Any, _flags: Any, code: Any, _properties: Any
    ) -> None:
        self.problem = f"the connection to {self._broker.host} has ended: {code}"

    def _on_message(self, _client: Any, _data: Any, message: Any) -> None:
        if len(self._waiting) == MAX_WAITING:
            self.lost += 1
        # One byte more than is taken: `measured` refuses it.
        message.payload = bytes(message.payload[: MAX_PAYLOAD_BYTES + 1])
        self._waiting.append(message)
        self._wake()
