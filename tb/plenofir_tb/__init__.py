"""What the testbenches share: stream driver and monitor, scoreboard, frames, runner."""
