"""A real mosquitto on a port of the test's own, and the messages that it received."""

import json
import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

from paho.mqtt.client import Client, MQTTMessage
from paho.mqtt.enums import CallbackAPIVersion

from tests.support.processes import Process, free_port
from tests.support.programs import program
from tests.support.tls import Certificate
from tests.support.waiting import wait_for

USER, PASSWORD = "twin", "a password: with spaces"


@dataclass
class Broker:
    """Where a broker is, or will be."""

    folder: Path
    port: int = field(default_factory=free_port)
    certificate: Certificate | None = None
    wants_password: bool = False

    @property
    def url(self) -> str:
        scheme = "mqtt" if self.certificate is None else "mqtts"
        return f"{scheme}://127.0.0.1:{self.port}"

    @contextmanager
    def running(self) -> Iterator[Process]:
        """The broker's process; it stores nothing from one start to the next."""
        lines = [f"listener {self.port} 127.0.0.1", "persistence false", "user root"]
        if self.certificate is not None:
            lines += [f"certfile {self.certificate.cert}", f"keyfile {self.certificate.key}"]
        if self.wants_password:
            users = self.folder / "users"
            given = ["-b", "-c", str(users), USER, PASSWORD]
            subprocess.run([program("mosquitto_passwd"), *given], check=True, capture_output=True)
            lines.append(f"password_file {users}")
        else:
            lines.append("allow_anonymous true")
        file = self.folder / "mosquitto.conf"
        file.write_text("\n".join(lines) + "\n", encoding="utf-8")
        with Process([program("mosquitto"), "-c", str(file)], os.environ) as process:
            process.wait_until_listening(self.port)
            yield process


class Subscriber:
    """Receives all that is published at a broker, in a thread of its own."""

    def __init__(self, broker: Broker, topics: str = "#") -> None:
        self.received: list[MQTTMessage] = []
        self._is_there = False
        self._client = Client(CallbackAPIVersion.VERSION2)
        self._client.on_connect = lambda client, *_: client.subscribe(topics, 1)
        self._client.on_subscribe = self._subscribed
        self._client.on_message = lambda _client, _data, message: self.received.append(message)
        if broker.wants_password:
            self._client.username_pw_set(USER, PASSWORD)
        self._client.connect("127.0.0.1", broker.port)

    def _subscribed(self, *_: Any) -> None:
        self._is_there = True

    def __enter__(self) -> Self:
        self._client.loop_start()
        wait_for(lambda: self._is_there, "the subscription")
        return self

    def __exit__(self, *_: object) -> None:
        self._client.disconnect()
        self._client.loop_stop()

    def publish(self, topic: str, payload: str, *, retain: bool = False) -> None:
        self._client.publish(topic, payload, 1, retain).wait_for_publish(60.0)

    def of(self, topic: str) -> list[bytes]:
        return [bytes(message.payload) for message in self.received if message.topic == topic]

    def last(self, topic: str) -> Any:
        """The latest payload of a topic as JSON; None: there is none."""
        found = self.of(topic)
        return json.loads(found[-1]) if found else None
