/// Functions as a source file shows them, and those that no product code calls.
#pragma once

#include <string>
#include <vector>

#include "tests/architecture/Rules.h"
#include "tests/architecture/SourceFile.h"

namespace tessera::architecture {

struct Function {
    std::string name;
    int line = 0;
    bool overrides = false;
    std::size_t at = 0;            ///< of the name in the file's code
    std::size_t from = 0, to = 0;  ///< its body; equal: none is here
};

/// What is declared or defined in namespaces and classes, in the order of the text. Constructors, destructors,
/// operators, macros and function objects are left out.
[[nodiscard]] std::vector<Function> functionsOf(const SourceFile& file);

/// A function that nothing calls here, and why it stays.
struct Uncalled {
    std::string file, name, reason;
    int line = 0;  ///< in the list
};
/// Lines of `file name: reason`; empty ones and those with # are left out. A line that is none becomes a finding.
[[nodiscard]] std::vector<Uncalled> parseUncalled(const std::string& text, const std::string& listFile,
                                                  Findings& findings);

/// Functions of headers that no product code calls, but those of the list; and lines of the list about what is called
/// or gone. A function is called where its name is a word in what is called: in code outside of functions, in main, in
/// constructors, destructors and operators, in what overrides a function of another's library, and in functions that
/// are called.
///
/// Names are all that counts. Functions of one name are called together, and a variable of that name calls them too.
[[nodiscard]] Findings checkFunctionsAreCalled(const std::vector<SourceFile>& files, const std::vector<Uncalled>& known,
                                               const std::string& listFile);

}  // namespace tessera::architecture
