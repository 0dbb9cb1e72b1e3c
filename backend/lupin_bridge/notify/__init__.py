"""Notifications without a page: MQTT and a webhook."""
