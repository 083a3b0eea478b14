"""What every virtual instrument is: messages, parser, parameters, device, status."""
