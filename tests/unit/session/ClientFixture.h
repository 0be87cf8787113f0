/// One peer's side, with the test speaking for the server and for the replica.
#pragma once

#include <gtest/gtest.h>

#include <set>

#include "common/session/ClientSession.h"
#include "tests/unit/session/ServerFixture.h"

namespace tessera {

inline Bytes content(std::size_t size, unsigned seed) {
    Bytes bytes(size);
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>((i * 131 + seed * 7919) >> 3);
    return bytes;
}

struct ClientFixture {
    explicit ClientFixture(ClientSessionConfig config = named()) : session(config) {}
    static ClientSessionConfig named() {
        ClientSessionConfig config;
        config.name = "a";
        config.chunkBytes = 100;
        config.chunksInFlight = 2;
        return config;
    }

    ClientSession session;
    TimePoint now{10s};
    ClientActions done;

    void take(ClientActions actions) { done.insert(done.end(), actions.begin(), actions.end()); }
    void hear(const Message& message, ChannelKind channel = ChannelKind::kControl) {
        take(session.received(channel, 3_epoch, message, now));
    }
    void connect() { take(session.channelOpened(ChannelKind::kControl, now)); }
    void welcomed() {
        connect();
        hear(message::Welcome{
            .epoch = 3_epoch, .token = {42, 43}, .heartbeat = 50ms, .configuration = textBytes("the wall")});
    }
    void bulkOpen() { take(session.channelOpened(ChannelKind::kBulk, now)); }
    /// Welcomed, and its replica stands at `sequence`.
    void inStep(Sequence sequence = 5_seq) {
        welcomed();
        hear(message::Snapshot{listAt(sequence)});
        take(session.applied(sequence, hashAfter(sequence)));
    }
    void answerChunks(const std::vector<Blob>& blobs) {
        for (bool more = true; more;) {
            more = false;
            for (const message::BlobRequest& request : sent<message::BlobRequest>(ChannelKind::kBulk)) {
                if (!answered.insert({request.id, request.offset}).second) continue;
                for (const Blob& blob : blobs) {
                    if (blob.id() != request.id) continue;
                    const ByteSpan part = blob.bytes().subspan(request.offset, request.length);
                    hear(message::BlobChunk{blob.id(), request.offset, blob.sizeBytes(),
                                            share(Bytes(part.begin(), part.end()))},
                         ChannelKind::kBulk);
                    more = true;
                }
            }
        }
    }
    std::set<std::pair<BlobId, std::uint64_t>> answered;

    template <typename A>
    std::vector<A> actions() const {
        std::vector<A> found;
        for (const ClientAction& action : done)
            if (const A* a = std::get_if<A>(&action)) found.push_back(*a);
        return found;
    }
    template <typename M>
    std::vector<M> sent(ChannelKind channel = ChannelKind::kControl) const {
        std::vector<M> found;
        for (const auto& send : actions<client_action::Send>())
            if (const M* m = std::get_if<M>(&send.message); m && send.channel == channel) found.push_back(*m);
        return found;
    }
};

inline BlobInfo infoOf(const Blob& blob) {
    return {blob.id(), blob.sizeBytes()};
}

}  // namespace tessera
