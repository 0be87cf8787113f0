/// What is wrong with a file in protobuf's text format, in words that a person can act on. For its readers alone.
#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/tokenizer.h>

#include <string>
#include <string_view>

namespace tessera {

/// Line and column from 0; negative: unknown.
struct TextPlace {
    int line = -1, column = -1;
};

/// "FILE:LINE:COLUMN: text", with lines and columns from 1.
[[nodiscard]] std::string located(std::string_view file, TextPlace place, std::string_view text);

/// Keeps the first error, in our words where protobuf's do not help.
class FirstTextFault : public google::protobuf::io::ErrorCollector {
public:
    /// Both outlive it. `root`: of the file's own message.
    FirstTextFault(std::string_view text, const google::protobuf::Descriptor& root) : text_(text), root_(root) {}

    void AddError(int line, google::protobuf::io::ColumnNumber column, const std::string& message) override;

    [[nodiscard]] bool any() const { return !message_.empty(); }
    [[nodiscard]] TextPlace place() const { return place_; }
    [[nodiscard]] const std::string& message() const { return message_; }

private:
    void pointAt(const std::string& word);

    std::string_view text_;
    const google::protobuf::Descriptor& root_;
    TextPlace place_;
    std::string message_;
};

}  // namespace tessera
