"""Pages of stored results: numbers, charts, and the frames behind them."""
