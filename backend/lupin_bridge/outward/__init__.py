"""What leaves the house by itself, where an operator wants it to: MQTT and a webhook."""
