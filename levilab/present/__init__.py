"""What people see, whatever it is about: numbers, words, terminal, progress, the style of figures."""
