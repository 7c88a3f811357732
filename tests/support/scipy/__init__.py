"""In place of the real scipy for the renderer of foreign frames: Debian 12's needs a Boost that excludes Boost 1.81."""
