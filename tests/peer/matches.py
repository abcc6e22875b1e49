"""Who is matched with a writer or a reader, for the tests.

The Python of Cyclone DDS asks for their number and then for them: when one more has come in between, it raises an
IndexError.
"""


def subscriptions(writer):
    return repeated(writer.get_matched_subscriptions)


def publications(reader):
    return repeated(reader.get_matched_publications)


def repeated(ask):
    while True:
        try:
            return ask()
        except IndexError:
            continue
