"""The commands: translate, call, print."""
