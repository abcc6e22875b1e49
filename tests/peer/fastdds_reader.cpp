// An independent reader (Fast DDS 2) of the gateway's topics, for the tests.
//
// Usage: fastdds_reader DOMAIN KIND TOPIC DURABILITY TRANSPORT
// KIND is turn, hazard, diagnostics, or gid16 / gid24 (the ROS graph with identifiers of that
// length); DURABILITY is transient_local or volatile; TRANSPORT is loopback (UDP on 127.0.0.1 and
// nothing else) or default (what Fast DDS does by itself: shared memory, and UDP everywhere).
// Prints a line of JSON for each event: `ready`, `matched` and `unmatched`, `sample`. Ends when
// standard input does.

#include <cstdint>
#include <cstdio>
#include <functional>
#include <iostream>
#include <iterator>
#include <map>
#include <memory>
#include <mutex>
#include <sstream>
#include <string>
#include <vector>

#include <fastcdr/Cdr.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

#include "fastdds_raw.hpp"

using eprosima::fastcdr::Cdr;
using Json = std::string;

template <typename Number>
Json number(Cdr& cdr) {
    Number value;
    cdr >> value;
    return std::to_string(value);
}

Json text(Cdr& cdr) {
    std::string value;
    cdr >> value;
    Json json = "\"";
    for (unsigned char letter : value) {
        char escape[8];
        std::snprintf(escape, sizeof escape, "\\u%04x", letter);
        json += letter < ' ' || letter == '"' || letter == '\\' ? Json(escape) : Json(1, static_cast<char>(letter));
    }
    return json + "\"";
}

Json several(uint32_t count, const std::function<Json()>& one) {
    Json json = "[";
    for (uint32_t i = 0; i < count; ++i) {
        json += (i == 0 ? "" : ",") + one();
    }
    return json + "]";
}

Json sequence(Cdr& cdr, const std::function<Json()>& one) {
    uint32_t length;
    cdr >> length;
    return several(length, one);
}

// Fields are read in the order in which they are named.
Json object(std::initializer_list<std::pair<const char*, std::function<Json()>>> fields) {
    Json json = "{";
    for (const auto& [name, read] : fields) {
        json += (json.size() == 1 ? "\"" : ",\"") + Json(name) + "\":" + read();
    }
    return json + "}";
}

Json stamp(Cdr& cdr) {
    return object({{"sec", [&] { return number<int32_t>(cdr); }}, {"nanosec", [&] { return number<uint32_t>(cdr); }}});
}

Json report(Cdr& cdr) {
    return object({{"stamp", [&] { return stamp(cdr); }}, {"report", [&] { return number<uint8_t>(cdr); }}});
}

Json diagnostics(Cdr& cdr) {
    const auto read_text = [&] { return text(cdr); };
    const auto header = [&] { return object({{"stamp", [&] { return stamp(cdr); }}, {"frame_id", read_text}}); };
    const auto key_value = [&] { return object({{"key", read_text}, {"value", read_text}}); };
    const auto status = [&] {
        return object({
            {"level", [&] { return number<uint8_t>(cdr); }},
            {"name", read_text},
            {"message", read_text},
            {"hardware_id", read_text},
            {"values", [&] { return sequence(cdr, key_value); }},
        });
    };
    return object({{"header", header}, {"status", [&] { return sequence(cdr, status); }}});
}

Json graph(Cdr& cdr, uint32_t length) {
    const auto read_text = [&] { return text(cdr); };
    const auto gid = [&] { return several(length, [&] { return number<uint8_t>(cdr); }); };
    const auto gids = [&] { return sequence(cdr, gid); };
    const auto node = [&] {
        return object({
            {"node_namespace", read_text},
            {"node_name", read_text},
            {"reader_gid_seq", gids},
            {"writer_gid_seq", gids},
        });
    };
    return object({{"gid", gid}, {"node_entities_info_seq", [&] { return sequence(cdr, node); }}});
}

struct Kind {
    const char* type;
    std::function<Json(Cdr&)> read;
};

const std::map<std::string, Kind> KINDS{
    {"turn", {"autoware_vehicle_msgs::msg::dds_::TurnIndicatorsReport_", report}},
    {"hazard", {"autoware_vehicle_msgs::msg::dds_::HazardLightsReport_", report}},
    {"diagnostics", {"diagnostic_msgs::msg::dds_::DiagnosticArray_", diagnostics}},
    {"gid16", {"rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_", [](Cdr& cdr) { return graph(cdr, 16); }}},
    {"gid24", {"rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_", [](Cdr& cdr) { return graph(cdr, 24); }}},
};

void say(const Json& line) {
    static std::mutex one_at_a_time;
    const std::lock_guard<std::mutex> guard(one_at_a_time);
    std::cout << line << std::endl;
}

class Listener : public fast::DataReaderListener {
public:
    explicit Listener(const Kind& kind) : kind_(kind) {}

    void on_subscription_matched(fast::DataReader*, const fast::SubscriptionMatchedStatus& status) override {
        std::ostringstream writer;
        writer << std::hex;
        for (int i = 0; i < 16; ++i) {
            const int byte = status.last_publication_handle.value[i];
            writer << byte / 16 << byte % 16;
        }
        const Json event = status.current_count_change > 0 ? "matched" : "unmatched";
        say(R"({"event":")" + event + R"(","writer":")" + writer.str() + "\"}");
    }

    void on_requested_incompatible_qos(fast::DataReader*, const fast::RequestedIncompatibleQosStatus&) override {
        say(R"({"event":"incompatible"})");
    }

    void on_data_available(fast::DataReader* reader) override {
        Payload payload;
        fast::SampleInfo info;
        while (reader->take_next_sample(&payload, &info) == ReturnCode_t::RETCODE_OK) {
            if (!info.valid_data) {
                continue;
            }
            try {
                eprosima::fastcdr::FastBuffer buffer(payload.data(), payload.size());
                Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
                cdr.read_encapsulation();
                const Json data = kind_.read(cdr);
                const size_t left = payload.size() - cdr.getSerializedDataLength();
                say(R"({"event":"sample","data":)" + data + R"(,"left":)" + std::to_string(left) + "}");
            } catch (const eprosima::fastcdr::exception::Exception& error) {
                say(R"({"event":"garbled"})");
                std::cerr << error.what() << std::endl;
            }
        }
    }

private:
    const Kind& kind_;
};

int main(int count, char** words) {
    if (count != 6 || KINDS.count(words[2]) == 0) {
        std::cerr << "usage: fastdds_reader DOMAIN KIND TOPIC DURABILITY TRANSPORT" << std::endl;
        return 2;
    }
    const Kind& kind = KINDS.at(words[2]);

    fast::DomainParticipantQos participant_qos;
    if (words[5] == std::string("loopback")) {
        const auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
        udp->interfaceWhiteList = {"127.0.0.1"};
        participant_qos.transport().use_builtin_transports = false;
        participant_qos.transport().user_transports = {udp};
    }
    auto* const factory = fast::DomainParticipantFactory::get_instance();
    auto* const participant = factory->create_participant(static_cast<uint32_t>(std::stoul(words[1])), participant_qos);
    if (participant == nullptr) {
        std::cerr << "no participant" << std::endl;
        return 1;
    }
    fast::TypeSupport(new Raw(kind.type, 64)).register_type(participant);
    auto* const topic = participant->create_topic(words[3], kind.type, fast::TOPIC_QOS_DEFAULT);
    auto* const subscriber = participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);

    fast::DataReaderQos qos;
    qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = words[4] == std::string("transient_local") ? fast::TRANSIENT_LOCAL_DURABILITY_QOS
                                                                       : fast::VOLATILE_DURABILITY_QOS;
    qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = 10;
    qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    Listener listener(kind);
    say(R"({"event":"ready"})");
    if (subscriber->create_datareader(topic, qos, &listener) == nullptr) {
        std::cerr << "no reader" << std::endl;
        return 1;
    }

    std::string ignored(std::istreambuf_iterator<char>(std::cin), {});
    // Says goodbye to the network.
    participant->delete_contained_entities();
    factory->delete_participant(participant);
}
