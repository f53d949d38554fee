"""Results as Matplotlib figures, and the data behind them."""
