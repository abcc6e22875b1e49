// What the programs of Fast DDS 2 share: samples as bytes.
#pragma once

#include <cstdint>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include <fastdds/dds/topic/TopicDataType.hpp>

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

// A sample, encapsulation header included.
using Payload = std::vector<char>;

// A type of which only the name is known.
class Raw : public fast::TopicDataType {
public:
    // `size` is a first guess, bytes; a history grows its buffers.
    Raw(const std::string& name, uint32_t size) {
        setName(name.c_str());
        m_typeSize = size;
        auto_fill_type_object(false);
        auto_fill_type_information(false);
    }
    bool deserialize(rtps::SerializedPayload_t* from, void* to) override {
        static_cast<Payload*>(to)->assign(from->data, from->data + from->length);
        return true;
    }
    void* createData() override { return new Payload; }
    void deleteData(void* data) override { delete static_cast<Payload*>(data); }
    bool serialize(void* from, rtps::SerializedPayload_t* to) override {
        const auto& payload = *static_cast<Payload*>(from);
        std::memcpy(to->data, payload.data(), payload.size());
        to->length = static_cast<uint32_t>(payload.size());
        to->encapsulation = CDR_LE;
        return true;
    }
    std::function<uint32_t()> getSerializedSizeProvider(void* from) override {
        const auto size = static_cast<uint32_t>(static_cast<Payload*>(from)->size());
        return [size] { return size; };
    }
    bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};
