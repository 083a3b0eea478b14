"""What a bench publishes while it works, for views in other processes: messages, their publisher, their subscriber."""
