// Heads beside protobuf's own reader of the same schema, from seeds: valid ones, damaged ones, rubbish.
#include "common/codec/MessageHead.h"

#include <gtest/gtest.h>

#include <random>

#include "proto/journal.pb.h"

namespace tessera {
namespace {

/// It has fields of each kind that a head may hold.
using Peer = proto::journal::Opening;
constexpr int kSchema = 2, kProgram = 3, kNumber = 4, kEpoch = 5, kSequence = 7, kStateHash = 8;

Bytes written(std::mt19937_64& random) {
    HeadWriter writer;
    const auto number = [&] { return random() >> random() % 64; };
    for (std::size_t fields = random() % 8; fields > 0; --fields) {
        const int at = 1 + static_cast<int>(random() % 12);
        switch (random() % 3) {
            case 0:
                writer.varint(at, number());
                break;
            case 1:
                writer.fixed(at, number());
                break;
            default:
                writer.text(at, std::string(random() % 9, static_cast<char>(random())));
        }
    }
    return writer.bytes();
}

TEST(MessageHead, IsReadAsProtobufReadsIt) {
    for (std::uint64_t seed = 0; seed < 100'000; ++seed) {
        std::mt19937_64 random(seed);
        Bytes bytes = written(random);
        if (seed % 8 == 7) bytes.resize(random() % 40, static_cast<std::byte>(random()));
        for (std::size_t harm = seed % 4; harm > 0 && !bytes.empty(); --harm)
            bytes[random() % bytes.size()] = static_cast<std::byte>(random());
        if (seed % 16 == 5 && !bytes.empty()) bytes.resize(random() % bytes.size());

        Peer theirs;
        const bool good = theirs.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
        const Expected<HeadReader> ours = HeadReader::read(bytes);
        ASSERT_EQ(ours.has_value(), good) << "seed " << seed << ": " << testing::PrintToString(bytes);
        if (!good) continue;
        ASSERT_EQ(ours->fixed(kSchema), theirs.schema()) << "seed " << seed;
        ASSERT_EQ(ours->text(kProgram), theirs.program()) << "seed " << seed;
        ASSERT_EQ(ours->varint(kNumber), theirs.number()) << "seed " << seed;
        ASSERT_EQ(ours->varint(kEpoch), theirs.epoch()) << "seed " << seed;
        ASSERT_EQ(ours->varint(kSequence), theirs.sequence()) << "seed " << seed;
        ASSERT_EQ(ours->fixed(kStateHash), theirs.state_hash()) << "seed " << seed;
    }
}

}  // namespace
}  // namespace tessera
