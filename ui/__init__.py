"""Settings, panels and colours. No mathematics, no data access of its own."""
