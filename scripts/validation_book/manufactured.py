from validation_book.comparisons import Found, Subject
SUBJECT = Subject("manufactured", "x", lambda s: Found([]))
