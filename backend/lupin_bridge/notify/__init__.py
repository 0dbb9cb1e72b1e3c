"""Notifications without a page: MQTT, a webhook and Web Push."""
