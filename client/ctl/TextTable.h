/// Columns of text under their names, each as wide as its widest cell.
#pragma once

#include <string>
#include <vector>

namespace tessera {

class TextTable {
public:
    explicit TextTable(std::vector<std::string> names) : rows_{std::move(names)} {}
    /// As many cells as there are names.
    void add(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }
    /// Lines, each ended, without blanks at their ends; nothing where there are no rows.
    [[nodiscard]] std::string text() const;

private:
    std::vector<std::vector<std::string>> rows_;
};

}  // namespace tessera
