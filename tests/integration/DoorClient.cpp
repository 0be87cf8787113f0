#include "tests/integration/DoorClient.h"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>

namespace tessera::test {
namespace {

int dial(std::uint16_t port, int seconds) {
    const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const timeval patience{seconds, 0};
    setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    setsockopt(socket, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
    if (connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return socket;
    close(socket);
    return -1;
}

bool writeAll(int socket, const std::string& bytes) {
    std::size_t done = 0;
    while (done < bytes.size()) {
        const ssize_t some = ::send(socket, bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL);
        if (some <= 0) return false;
        done += static_cast<std::size_t>(some);
    }
    return true;
}

std::string hostLine(std::uint16_t port, const std::string& head) {
    return head.find("Host:") == std::string::npos ? "Host: 127.0.0.1:" + std::to_string(port) + "\r\n" : "";
}

}  // namespace

std::string sayRaw(std::uint16_t port, const std::string& bytes) {
    const int socket = dial(port, 20);
    if (socket < 0) return {};
    std::string all;
    (void)writeAll(socket, bytes);
    std::array<char, 65536> some{};
    for (ssize_t got = 0; (got = recv(socket, some.data(), some.size(), 0)) > 0;)
        all.append(some.data(), static_cast<std::size_t>(got));
    close(socket);
    return all;
}

HttpReply http(std::uint16_t port, const std::string& method, const std::string& target, const std::string& head,
               const std::string& body) {
    std::string request =
        method + " " + target + " HTTP/1.1\r\n" + hostLine(port, head) + head + "Connection: close\r\n";
    if (!body.empty() || method == "POST") request += "Content-Length: " + std::to_string(body.size()) + "\r\n";
    const std::string all = sayRaw(port, request + "\r\n" + body);
    HttpReply reply;
    if (!all.starts_with("HTTP/1.1 ")) return reply;
    reply.status = std::stoi(all.substr(9, 3));
    const std::size_t end = all.find("\r\n\r\n");
    reply.head = all.substr(0, end);
    if (end != std::string::npos) reply.body = all.substr(end + 4);
    return reply;
}

DoorSocket::DoorSocket(std::uint16_t port, const std::string& target, const std::string& head)
    : socket_(dial(port, 10)) {
    if (socket_ < 0) return;
    const std::string asked = "GET " + target + " HTTP/1.1\r\n" + hostLine(port, head) + head +
                              "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: "
                              "13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
    if (!writeAll(socket_, asked)) return;
    std::string answer;
    while (answer.find("\r\n\r\n") == std::string::npos && answer.size() < 65536) {
        char c = 0;
        if (recv(socket_, &c, 1, 0) != 1) break;
        answer += c;
    }
    // The key's answer is the standard's own example.
    open_ = answer.starts_with("HTTP/1.1 101") && answer.find("s3pPLMBiTxaQ9kYGzzhZRbK+xOo=") != std::string::npos;
    if (open_) return;
    refused_ = answer;
    for (char c = 0; recv(socket_, &c, 1, 0) == 1;) refused_ += c;
}

DoorSocket::~DoorSocket() {
    if (socket_ >= 0) close(socket_);
}

bool DoorSocket::send(int kind, const std::string& payload) {
    std::string frame(1, static_cast<char>(0x80 | kind));
    const std::size_t size = payload.size();
    if (size < 126) {
        frame += static_cast<char>(0x80 | size);
    } else {
        const int bytes = size < 65536 ? 2 : 8;
        frame += static_cast<char>(0x80 | (bytes == 2 ? 126 : 127));
        for (int i = bytes - 1; i >= 0; --i) frame += static_cast<char>(size >> (8 * i) & 255);
    }
    const std::string mask = "\x11\x22\x33\x44";
    frame += mask;
    for (std::size_t i = 0; i < size; ++i) frame += static_cast<char>(payload[i] ^ mask[i % 4]);
    return writeAll(socket_, frame);
}

bool DoorSocket::read(std::size_t bytes, std::string& into) {
    into.resize(bytes);
    for (std::size_t done = 0; done < bytes;) {
        const ssize_t some = recv(socket_, into.data() + done, bytes - done, 0);
        if (some <= 0) return false;
        done += static_cast<std::size_t>(some);
    }
    return true;
}

int DoorSocket::message(std::string& payload) {
    payload.clear();
    int kind = 0;
    std::string head, part;
    while (open_ && read(2, head)) {
        const int code = head[0] & 15;
        std::size_t size = static_cast<unsigned char>(head[1]) & 127;
        if (size >= 126) {
            std::string length;
            if (!read(size == 126 ? 2 : 8, length)) break;
            size = 0;
            for (const char c : length) size = size << 8 | static_cast<unsigned char>(c);
        }
        if (size > (std::size_t{1} << 30) || !read(size, part)) break;
        if (code == 9) {
            send(10, part);
        } else if (code == 8) {
            if (part.size() >= 2)
                closeCode_ = static_cast<unsigned char>(part[0]) << 8 | static_cast<unsigned char>(part[1]);
            if (part.size() > 2) closeReason_ = part.substr(2);
            break;
        } else if (code <= 2) {
            if (code != 0) kind = code;
            payload += part;
            if (head[0] & 0x80) return kind;
        }
    }
    open_ = false;
    return 0;
}

nlohmann::json DoorSocket::next() {
    std::string text;
    return message(text) == 1 ? nlohmann::json::parse(text) : nlohmann::json();
}

nlohmann::json DoorSocket::answerTo(int id) {
    std::string text;
    while (const int kind = message(text)) {
        if (kind != 1) continue;  // bytes of an earlier answer
        nlohmann::json said = nlohmann::json::parse(text);
        if (said.contains("id") && said["id"] == id) return said;
    }
    return {};
}

std::string DoorSocket::nextBinary() {
    std::string bytes;
    return message(bytes) == 2 ? bytes : std::string();
}

nlohmann::json DoorSocket::ask(int id, const std::string& request, const nlohmann::json& fields) {
    if (!sendText(nlohmann::json{{"id", id}, {"request", request}, {"fields", fields}}.dump())) return {};
    return answerTo(id);
}

}  // namespace tessera::test
