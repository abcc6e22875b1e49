// A reader of diagnostics with the Cyclone DDS that is installed here: Debian 12 has 0.10.2, which checks fragments more
// strictly than later ones.
//
// Usage: cyclone_reader DOMAIN
// Prints a line of JSON for each event: `ready`; `matched`; `sample`, with the key and the length of the first status's
// first value. Ends when standard input does.

#include <poll.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <dds/dds.h>

#include "diagnostics.h"

typedef diagnostic_msgs_msg_dds__DiagnosticArray_ Array;

static dds_entity_t made(dds_entity_t entity) {
    if (entity < 0) {
        fprintf(stderr, "cyclone_reader: %s\n", dds_strretcode(entity));
        exit(1);
    }
    return entity;
}

static void take(dds_entity_t reader) {
    void *samples[1] = {NULL};
    dds_sample_info_t info;
    while (dds_take(reader, samples, &info, 1, 1) > 0) {
        const Array *array = samples[0];
        if (info.valid_data && array->status._length > 0 && array->status._buffer[0].values._length > 0) {
            const diagnostic_msgs_msg_dds__DiagnosticStatus_ *status = &array->status._buffer[0];
            printf("{\"event\":\"sample\",\"length\":%zu,\"key\":\"%s\"}\n",
                   strlen(status->values._buffer[0].value), status->values._buffer[0].key);
        }
        dds_return_loan(reader, samples, 1);
    }
}

int main(int argc, char **argv) {
    if (argc != 2) {
        return 2;
    }
    setvbuf(stdout, NULL, _IOLBF, 0);
    const dds_entity_t participant = made(dds_create_participant((dds_domainid_t)atoi(argv[1]), NULL, NULL));
    dds_qos_t *qos = dds_create_qos();
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 100);
    const dds_entity_t topic = made(dds_create_topic(
        participant, &diagnostic_msgs_msg_dds__DiagnosticArray__desc, "rt/diagnostics", NULL, NULL));
    const dds_entity_t reader = made(dds_create_reader(participant, topic, qos, NULL));
    dds_delete_qos(qos);
    puts("{\"event\":\"ready\"}");
    bool was_matched = false;
    struct pollfd input = {.fd = 0, .events = POLLIN};
    // Nobody writes to it: it is readable when it has ended.
    while (poll(&input, 1, 5) == 0) {
        const bool is_matched = dds_get_matched_publications(reader, NULL, 0) > 0;
        if (is_matched && !was_matched) {
            puts("{\"event\":\"matched\"}");
        }
        was_matched = is_matched;
        take(reader);
    }
    return dds_delete(participant) < 0;
}
