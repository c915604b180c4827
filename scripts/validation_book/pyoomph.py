from validation_book.comparisons import Found, Subject
SUBJECT = Subject("pyoomph", "x", lambda s: Found([]))
