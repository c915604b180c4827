from validation_book.comparisons import Found, Subject
SUBJECT = Subject("balances", "x", lambda s: Found([]))
