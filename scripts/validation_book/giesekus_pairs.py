from validation_book.comparisons import Found, Subject
SUBJECT = Subject("giesekus-pairs", "x", lambda s: Found([]))
