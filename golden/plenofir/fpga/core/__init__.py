"""What cores can be built for: their generics, limits, resources and latency."""
