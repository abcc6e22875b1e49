// A client of a node's list_parameters, as rmw_fastrtps makes one (Fast DDS 2), for the tests.
//
// Usage: fastdds_client DOMAIN NODE, with NODE as `vehicle/signal_gateway`; over UDP on 127.0.0.1. The request names the
// client's reader, and the response is known by that name and the number of the request's sample. Prints a line of JSON for each event:
// `ready`, `answer` with the names of the response and whether it is the one to our request. Ends when standard input does.

#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <functional>
#include <iostream>
#include <iterator>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <fastcdr/Cdr.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/common/WriteParams.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

#include "fastdds_raw.hpp"

using eprosima::fastcdr::Cdr;

fast::Topic* topic(fast::DomainParticipant* participant, const std::string& name, const std::string& type) {
    fast::TypeSupport(new Raw(type, 1024)).register_type(participant);
    return participant->create_topic(name, type, fast::TOPIC_QOS_DEFAULT);
}

std::string names(Payload& payload) {
    eprosima::fastcdr::FastBuffer buffer(payload.data(), payload.size());
    Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
    cdr.read_encapsulation();
    std::vector<std::string> names;
    cdr >> names;
    std::string json;
    for (const auto& name : names) {
        json += (json.empty() ? "\"" : ",\"") + name + "\"";
    }
    return "[" + json + "]";
}

int main(int count, char** words) {
    if (count != 3) {
        std::cerr << "usage: fastdds_client DOMAIN NODE" << std::endl;
        return 2;
    }
    fast::DomainParticipantQos participant_qos;
    const auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList = {"127.0.0.1"};
    participant_qos.transport().use_builtin_transports = false;
    participant_qos.transport().user_transports = {udp};
    auto* const factory = fast::DomainParticipantFactory::get_instance();
    auto* const participant = factory->create_participant(static_cast<uint32_t>(std::stoul(words[1])), participant_qos);
    const std::string service = std::string(words[2]) + "/list_parameters";
    const std::string type = "rcl_interfaces::srv::dds_::ListParameters_";
    auto* const requests = topic(participant, "rq/" + service + "Request", type + "Request_");
    auto* const replies = topic(participant, "rr/" + service + "Reply", type + "Response_");

    fast::DataReaderQos reader_qos;
    reader_qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
    reader_qos.history().depth = 10;
    reader_qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    auto* const reader = participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT)->create_datareader(replies, reader_qos);
    fast::DataWriterQos writer_qos;
    writer_qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
    writer_qos.history().depth = 10;
    writer_qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    auto* const writer = participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT)->create_datawriter(requests, writer_qos);

    std::atomic<bool> ended{false};
    std::thread client([&] {
        const auto pause = [] { std::this_thread::sleep_for(std::chrono::milliseconds(5)); };
        fast::PublicationMatchedStatus server;
        fast::SubscriptionMatchedStatus answers;
        while (!ended && (server.current_count == 0 || answers.current_count == 0)) {
            writer->get_publication_matched_status(server);
            reader->get_subscription_matched_status(answers);
            pause();
        }
        std::cout << R"({"event":"ready"})" << std::endl;
        // No prefix, any depth: an empty sequence, padding, and a number of eight bytes.
        Payload request{0, 1, 0, 0};
        request.resize(4 + 16, 0);
        std::set<rtps::SequenceNumber_t> numbers;
        // Every 2 s, since a node that does not know the client within 2 s does not answer.
        for (int look = 0; !ended; ++look) {
            if (look % 400 == 0) {
                rtps::WriteParams parameters;
                parameters.related_sample_identity().writer_guid() = reader->guid();
                writer->write(&request, parameters);
                numbers.insert(parameters.sample_identity().sequence_number());
            }
            Payload payload;
            fast::SampleInfo info;
            while (reader->take_next_sample(&payload, &info) == ReturnCode_t::RETCODE_OK) {
                const auto& related = info.related_sample_identity;
                const bool is_ours = related.writer_guid() == reader->guid() && numbers.count(related.sequence_number()) > 0;
                std::cout << R"({"event":"answer","is_ours":)" << (is_ours ? "true" : "false") << R"(,"names":)"
                          << names(payload) << "}" << std::endl;
            }
            pause();
        }
    });
    std::string ignored(std::istreambuf_iterator<char>(std::cin), {});
    ended = true;
    client.join();
    participant->delete_contained_entities();
    factory->delete_participant(participant);
}
