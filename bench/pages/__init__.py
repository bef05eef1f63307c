"""What is stored as a page: numbers, charts, and the frames behind them."""
