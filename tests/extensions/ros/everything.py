"""A message with all types of fields that ROS 2 has, and a peer of Fast DDS, ROS 2's default, that knows it.

The peer is ours, with the code that `fastddsgen` makes of the IDL; it is built once, into the folder of the oracles.
Arrays of strings are not among its fields: the code that `fastddsgen` 2.3 makes passes over them. The peer reads
`rt/ping`, prints each message as a line of JSON and sends it back on `rt/pong`; it counts what comes on
`rt/counts_in` from 1 on, and sends as many messages on `rt/counts_out` as it is asked for.
"""

from __future__ import annotations

import fcntl
import hashlib
import subprocess
import tempfile
from pathlib import Path

from tests.outside import program
from tools import oracles

MSG = {
    "demo/msg/Inner.msg": "# a comment\nint8 small -3\nfloat64 large 2.5  # with a comment\nstring name 'in # it'\n",
    "demo/msg/Count.msg": "uint64 n\nfloat64 t\n",
    "demo/msg/Everything.msg": """\
uint8 A_CONSTANT=7
string ANOTHER = "x"
bool flag true
byte raw
char letter
int8 a
uint8 b 0x10
int16 c
uint16 d
int32 e
uint32 f
int64 g
uint64 h
float32 x
float64 y
string text "as \\"it\\" was"
string<=10 short_text
Inner inner
uint8[3] octets
float64[2] pair [1.5, -2.0]
int16[] many
int64[<=4] few
string[] words ["one", "two"]
demo/Inner[] inners
demo/msg/Inner[2] both
bool[<=3] flags [true, false]
uint8[] bytes
float32 after
""",
}
IDL = """\
module demo { module msg { module dds_ {
struct Inner_ { int8 small; double large; string name; };
struct Count_ { unsigned long long n; double t; };
struct Everything_ {
    boolean flag; octet raw; uint8 letter; int8 a; uint8 b; short c; unsigned short d; long e; unsigned long f;
    long long g; unsigned long long h; float x; double y; string text; string<10> short_text; Inner_ inner;
    uint8 octets[3]; double pair[2]; sequence<short> many; sequence<long long, 4> few; sequence<string> words;
    sequence<Inner_> inners; Inner_ both[2]; sequence<boolean, 3> flags; sequence<uint8> bytes;
    float after;
};
}; }; };
"""
PEER = r"""
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <mutex>
#include <sstream>
#include <thread>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include "everythingPubSubTypes.h"

using namespace eprosima::fastdds::dds;
using namespace demo::msg::dds_;

static std::mutex printing;
static void line(const std::string& text) {
    std::lock_guard<std::mutex> hold(printing);
    std::cout << text << std::endl;
}

struct Json {
    std::ostringstream out;
    void put(bool v) { out << (v ? "true" : "false"); }
    void put(const std::string& v) {
        out << '"';
        for (unsigned char c : v) {
            if (c == '"' || c == '\\') out << '\\' << c;
            else if (c < 0x20) { char b[8]; snprintf(b, 8, "\\u%04x", c); out << b; }
            else out << c;
        }
        out << '"';
    }
    void put(double v) {
        char b[40];
        if (std::isnan(v)) out << "NaN";
        else if (std::isinf(v)) out << (v < 0 ? "-Infinity" : "Infinity");
        else { snprintf(b, sizeof b, "%.17g", v); out << b; }
    }
    void put(float v) { put((double)v); }
    void put(uint8_t v) { out << (unsigned)v; }
    void put(int8_t v) { out << (int)v; }
    void put(int16_t v) { out << v; }
    void put(uint16_t v) { out << v; }
    void put(int32_t v) { out << v; }
    void put(uint32_t v) { out << v; }
    void put(int64_t v) { out << v; }
    void put(uint64_t v) { out << v; }
    template <size_t N> void put(const eprosima::fastrtps::fixed_string<N>& v) { put(std::string(v.c_str())); }
    void put(const Inner_& v) {
        out << "{"; key("small", true); put(v.small()); key("large"); put(v.large()); key("name"); put(v.name());
        out << "}";
    }
    template <class T, size_t N> void put(const std::array<T, N>& v) { many(v); }
    template <class T> void put(const std::vector<T>& v) { many(v); }
    void put(const std::vector<bool>& v) {
        out << "[";
        for (size_t i = 0; i < v.size(); i++) { if (i) out << ","; put((bool)v[i]); }
        out << "]";
    }
    template <class C> void many(const C& v) {
        out << "[";
        bool first = true;
        for (const auto& one : v) { if (!first) out << ","; first = false; put(one); }
        out << "]";
    }
    void key(const char* name, bool first = false) { out << (first ? "\"" : ",\"") << name << "\":"; }
};
#define FIELD(name) json.key(#name); json.put(m.name());
static std::string shown(const Everything_& m) {
    Json json;
    json.out << "{\"flag\":"; json.put(m.flag());
    FIELD(raw) FIELD(letter) FIELD(a) FIELD(b) FIELD(c) FIELD(d) FIELD(e) FIELD(f) FIELD(g) FIELD(h) FIELD(x) FIELD(y)
    FIELD(text) FIELD(short_text) FIELD(inner) FIELD(octets) FIELD(pair) FIELD(many) FIELD(few) FIELD(words)
    FIELD(inners) FIELD(both) FIELD(flags) FIELD(bytes) FIELD(after)
    json.out << "}";
    return json.out.str();
}

struct Echo : DataReaderListener {
    DataWriter* back = nullptr;
    void on_data_available(DataReader* reader) override {
        Everything_ m; SampleInfo info;
        while (reader->take_next_sample(&m, &info) == ReturnCode_t::RETCODE_OK)
            if (info.valid_data) { line(shown(m)); back->write(&m); }
    }
};
struct Counter : DataReaderListener {
    std::atomic<uint64_t> last{0}, wrong{0};
    std::atomic<bool> heard{false};
    void on_data_available(DataReader* reader) override {
        Count_ m; SampleInfo info;
        while (reader->take_next_sample(&m, &info) == ReturnCode_t::RETCODE_OK)
            if (info.valid_data) {
                heard = true;
                if (m.n() == last + 1) last = m.n();
                if (m.n() != 0 && (m.n() != last || m.t() != m.n() / 2.0)) wrong++;
            }
    }
};

int main(int, char** given) {
    DomainParticipantQos of;
    of.transport().use_builtin_transports = false;
    auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList.push_back("127.0.0.1");
    udp->maxInitialPeersRange = 10;
    of.transport().user_transports.push_back(udp);
    eprosima::fastrtps::rtps::Locator_t here;
    eprosima::fastrtps::rtps::IPLocator::setIPv4(here, 127, 0, 0, 1);
    of.wire_protocol().builtin.metatrafficUnicastLocatorList.push_back(here);
    of.wire_protocol().builtin.initialPeersList.push_back(here);
    auto* participant = DomainParticipantFactory::get_instance()->create_participant(std::atoi(given[1]), of);
    if (!participant) return 1;
    TypeSupport everything(new Everything_PubSubType()), count(new Count_PubSubType());
    everything.register_type(participant);
    count.register_type(participant);
    auto* publisher = participant->create_publisher(PUBLISHER_QOS_DEFAULT);
    auto* subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
    DataWriterQos writing;
    writing.reliability().kind = RELIABLE_RELIABILITY_QOS;
    writing.durability().kind = VOLATILE_DURABILITY_QOS;
    writing.history().depth = 1000;
    writing.reliable_writer_qos().times.heartbeatPeriod = eprosima::fastrtps::Duration_t(0, 10000000);
    writing.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    DataReaderQos reading;
    reading.reliability().kind = RELIABLE_RELIABILITY_QOS;
    reading.durability().kind = VOLATILE_DURABILITY_QOS;
    reading.history().depth = 1000;
    reading.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    Echo echo; Counter counter;
    auto topic = [&](const char* name, TypeSupport& type) {
        return participant->create_topic(name, type.get_type_name(), TOPIC_QOS_DEFAULT);
    };
    echo.back = publisher->create_datawriter(topic("rt/pong", everything), writing);
    auto* out = publisher->create_datawriter(topic("rt/counts_out", count), writing);
    if (!subscriber->create_datareader(topic("rt/ping", everything), reading, &echo)) return 1;
    if (!subscriber->create_datareader(topic("rt/counts_in", count), reading, &counter)) return 1;
    line("ready");
    std::string word;
    uint64_t number;
    while (std::cin >> word >> number) {
        if (word == "publish") {
            PublicationMatchedStatus status;
            while (out->get_publication_matched_status(status), status.current_count == 0)
                std::this_thread::sleep_for(std::chrono::milliseconds(2));
            for (uint64_t n = 1; n <= number; n++) {
                Count_ m; m.n(n); m.t(n / 2.0);
                out->write(&m);
            }
            line("published " + std::to_string(number));
        } else if (word == "count") {
            while (counter.last < number) std::this_thread::sleep_for(std::chrono::milliseconds(2));
            line("counted " + std::to_string(counter.last) + " wrong " + std::to_string(counter.wrong));
        } else if (word == "heard") {
            line(counter.heard ? "yes" : "no");
        }
    }
    participant->delete_contained_entities();
    DomainParticipantFactory::get_instance()->delete_participant(participant);
    return 0;
}
"""


def peer() -> Path:
    """The program, which is built where it is missing."""
    generator, compiler = program("fastdds"), program("g++")
    digest = hashlib.sha256(f"{IDL}{PEER}".encode()).hexdigest()[:12]
    built = oracles.folder() / f"fastdds-peer-{digest}"
    oracles.folder().mkdir(parents=True, exist_ok=True)
    with open(oracles.folder() / "fastdds.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not built.exists():
            with tempfile.TemporaryDirectory(dir=oracles.folder()) as name:
                Path(name, "everything.idl").write_text(IDL)
                Path(name, "peer.cpp").write_text(PEER)
                sources = ["peer.cpp", "everything.cxx", "everythingPubSubTypes.cxx"]
                libraries = ["-lfastrtps", "-lfastcdr", "-lpthread"]
                compile_it = [compiler, "-O1", "-std=c++17", "-w", "-o", "peer", *sources, *libraries]
                for command in ([generator, "everything.idl"], compile_it):
                    subprocess.run(command, cwd=name, check=True, capture_output=True)
                Path(name, "peer").rename(built)
    return built
