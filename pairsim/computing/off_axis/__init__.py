"""Rates of displaced particles as tables and words, for their own question and for others beside theirs."""
