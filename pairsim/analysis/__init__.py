"""What tables say: master curves, time series, travels, the part of inputs in an answer."""
