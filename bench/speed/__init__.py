"""Speed and memory, as ratios against C and peers on the same machine, measured in turns."""
