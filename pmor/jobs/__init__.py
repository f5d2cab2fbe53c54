"""The two stages as jobs: with files, locks, progress on the screen and threads around what they compute."""
