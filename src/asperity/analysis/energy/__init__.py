"""What a field gives to the hand, where its force jumps, how much texture it renders."""
