"""Who is matched with a writer or a reader, and when that or what was received has changed, for the tests.

The Python of Cyclone DDS asks for their number and then for them: when one more has come in between, it raises an
IndexError.
"""


from cyclonedds.core import DDSStatus, WaitSet
from cyclonedds.util import duration

CHANGES = DDSStatus.DataAvailable | DDSStatus.SubscriptionMatched, DDSStatus.PublicationMatched


class Changes:
    """Waits for samples or matches of readers and writers."""

    def __init__(self, participant, readers=(), writers=()):
        self.waitset = WaitSet(participant)
        self.endpoints = [*readers, *writers]
        for endpoints, statuses in zip((readers, writers), CHANGES):
            for endpoint in endpoints:
                endpoint.set_status_mask(statuses)
                self.waitset.attach(endpoint)

    def wait(self):
        """Until something has changed since the last wait, or for 50 ms, in which nobody misses an end."""
        self.waitset.wait(duration(milliseconds=50))
        for endpoint in self.endpoints:
            endpoint.take_status()


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
