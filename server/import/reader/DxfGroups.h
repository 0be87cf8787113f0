/// The pairs of a code and a value that a DXF file is made of, in text and in binary.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Error.h"
#include "common/math/Types.h"

namespace tessera {

struct DxfGroup {
    int code = 0;
    std::string_view text;  ///< of a file in text the value without its line break; of a binary one, where it is text
    std::optional<double> binary;

    /// NaN where it is none.
    [[nodiscard]] double number() const;
    /// 0 where it is none.
    [[nodiscard]] std::int64_t integer() const;
};

/// What a code 0 begins: an entity, a row of a table, a mark of the file.
struct DxfRecord {
    std::string_view type;
    std::vector<DxfGroup> groups;  ///< up to the next code 0; without data of applications and embedded objects

    [[nodiscard]] const DxfGroup* find(int code) const;
    [[nodiscard]] double number(int code, double otherwise) const;
    [[nodiscard]] std::int64_t integer(int code, std::int64_t otherwise) const;
    /// Without spaces at its ends.
    [[nodiscard]] std::string_view word(int code) const;
    /// Of `code`, `code` + 10 and `code` + 20; what is not there is `otherwise`'s.
    [[nodiscard]] Vec3d point(int code, const Vec3d& otherwise = Vec3d::Zero()) const;
    /// All points of that code, in the order of the file; z of those that have none is `z`.
    [[nodiscard]] std::vector<Vec3d> points(int code, double z = 0) const;
    [[nodiscard]] std::vector<double> numbers(int code) const;
};

/// Reads records one after the other. Nothing is allocated by counts that the file says.
class DxfGroups {
public:
    /// Nothing where the file does not begin as one: its first group is no code 0, or there is none.
    [[nodiscard]] static Expected<DxfGroups> of(std::string_view bytes);

    /// False at the file's end, or at a fault. The record before an end without "EOF" is not given: it may be half.
    bool next(DxfRecord& record);
    /// What is wrong there, with its line or byte; empty: nothing.
    [[nodiscard]] const std::string& fault() const { return fault_; }
    /// Whether the last thing read was the file's own end.
    [[nodiscard]] bool ended() const { return ended_; }
    /// "line 12" or "byte 345": where the next record begins.
    [[nodiscard]] std::string place() const;

    struct Mark {
        std::size_t at = 0, line = 1;
        DxfGroup head;
    };
    [[nodiscard]] Mark mark() const { return {at_, line_, head_}; }
    void goTo(const Mark& mark);

private:
    DxfGroups(std::string_view bytes, std::size_t at, bool isBinary, bool shortCodes, char lineEnd)
        : bytes_(bytes), at_(at), binary_(isBinary), shortCodes_(shortCodes), lineEnd_(lineEnd) {}

    bool readGroup(DxfGroup& group);
    bool readText(DxfGroup& group);
    bool readBinary(DxfGroup& group);
    bool takeLine(std::string_view& line);
    bool failHere(const std::string& what);

    std::string_view bytes_;
    std::size_t at_ = 0, line_ = 1;
    bool binary_ = false, shortCodes_ = false, ended_ = false;
    char lineEnd_ = '\n';
    DxfGroup head_;  ///< the code 0 that the next record begins with
    std::string fault_;
};

}  // namespace tessera
