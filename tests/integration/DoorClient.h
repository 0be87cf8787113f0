/// A program that comes in through a server's console, written from the standards (RFC 9112, RFC 6455) alone: nothing
/// of it is shared with the door.
#pragma once

#include <chrono>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace tessera::test {

struct HttpReply {
    int status = 0;  ///< 0: none came
    std::string head, body;
};
/// One request on a connection of its own; `head`: more lines, each ended by CR LF.
[[nodiscard]] HttpReply http(std::uint16_t port, const std::string& method, const std::string& target,
                             const std::string& head, const std::string& body = {});
/// The bytes as they are; all that comes until the other end closes, or 5 s are over.
[[nodiscard]] std::string sayRaw(std::uint16_t port, const std::string& bytes);

class DoorSocket {
public:
    /// `target`: "/socket?token=…". Where it is refused, `refused` has the answer.
    DoorSocket(std::uint16_t port, const std::string& target, const std::string& head = {});
    ~DoorSocket();
    DoorSocket(const DoorSocket&) = delete;
    DoorSocket& operator=(const DoorSocket&) = delete;

    [[nodiscard]] bool open() const { return open_; }
    [[nodiscard]] const std::string& refused() const { return refused_; }
    bool sendText(const std::string& text) { return send(1, text); }
    bool sendBinary(const std::string& bytes) { return send(2, bytes); }
    /// The next text, within 10 s; null: it closed, or nothing came. Pings are answered.
    [[nodiscard]] nlohmann::json next();
    /// Until one with this id comes; others are dropped.
    [[nodiscard]] nlohmann::json answerTo(int id);
    /// The next message, which is binary.
    [[nodiscard]] std::string nextBinary();
    /// Asks and waits.
    [[nodiscard]] nlohmann::json ask(int id, const std::string& request,
                                     const nlohmann::json& fields = nlohmann::json::object());
    /// Why it was closed: the code, and the reason; 0: it was not.
    [[nodiscard]] int closeCode() const { return closeCode_; }
    [[nodiscard]] const std::string& closeReason() const { return closeReason_; }

private:
    bool send(int kind, const std::string& payload);
    bool read(std::size_t bytes, std::string& into);
    /// A whole message: its kind, 1 or 2; 0: none.
    int message(std::string& payload);

    int socket_ = -1;
    bool open_ = false;
    std::string refused_, closeReason_;
    int closeCode_ = 0;
};

}  // namespace tessera::test
