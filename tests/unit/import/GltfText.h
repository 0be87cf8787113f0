/// Small glTF files for tests.
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tessera {

inline std::string base64(std::string_view bytes) {
    constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t group = 0;
        for (std::size_t k = 0; k < 3; ++k)
            group = group << 8 | (i + k < bytes.size() ? static_cast<std::uint8_t>(bytes[i + k]) : 0u);
        for (int shift = 18; shift >= 0; shift -= 6) text.push_back(digits[group >> shift & 63]);
    }
    for (std::size_t i = 0; i < (3 - bytes.size() % 3) % 3; ++i) text[text.size() - 1 - i] = '=';
    return text;
}

/// A glTF file under construction: one buffer, one view per accessor.
class GltfText {
public:
    /// Returns the accessor's number.
    template <typename T>
    int add(const std::vector<T>& values, int componentType, const char* type, std::size_t count,
            const std::string& more = "") {
        const std::string bytes(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
        views_.push_back(
            fmt::format(R"({{"buffer":0,"byteOffset":{},"byteLength":{}}})", buffer_.size(), bytes.size()));
        buffer_ += bytes + std::string((4 - bytes.size() % 4) % 4, '\0');
        accessors_.push_back(fmt::format(R"({{"bufferView":{},"componentType":{},"count":{},"type":"{}"{}}})",
                                         views_.size() - 1, componentType, count, type, more));
        return static_cast<int>(accessors_.size()) - 1;
    }
    int floats(const std::vector<float>& values, const char* type, std::size_t components) {
        return add(values, 5126, type, values.size() / components);
    }
    /// `rest`: nodes, meshes and so on.
    [[nodiscard]] std::string text(const std::string& rest) const {
        return fmt::format(
            R"({{"asset":{{"version":"2.0"}},"scene":0,"buffers":[{{"byteLength":{},
            "uri":"data:application/octet-stream;base64,{}"}}],
            "bufferViews":[{}],"accessors":[{}],{}}})",
            buffer_.size(), base64(buffer_), fmt::join(views_, ","), fmt::join(accessors_, ","), rest);
    }

private:
    std::string buffer_;
    std::vector<std::string> views_, accessors_;
};

}  // namespace tessera
