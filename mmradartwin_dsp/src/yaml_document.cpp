#include "yaml_document.h"

#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <map>
#include <sstream>
#include <vector>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

constexpr std::size_t kMostNodes = 1'000'000;

/// Measures a document before yaml-cpp makes nodes of it, aliases counted as if they were written out.
class DocumentCheck : public YAML::EventHandler {
 public:
  explicit DocumentCheck(const std::string& name) : name_(name) {}

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (++documents_ > 1) fail(mark, "holds several YAML documents; expected one mapping");
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override { leaf(mark, anchor); }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor, const std::string&) override {
    leaf(mark, anchor);
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    if (std::any_of(open_.begin(), open_.end(), [&](const Open& o) { return o.anchor == anchor; })) {
      fail(mark, "has an alias (*) to the very value it stands in; write the value out");
    }
    add(mark, sizes_[anchor]);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    begin(mark, anchor);
  }
  void OnSequenceEnd() override { end(); }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    begin(mark, anchor);
  }
  void OnMapEnd() override { end(); }

 private:
  struct Open {
    YAML::anchor_t anchor;
    std::size_t nodes_before;
  };
  [[noreturn]] void fail(const YAML::Mark& mark, const std::string& why) const {
    throw InputError(name_ + ": line " + std::to_string(mark.line + 1) + ": " + why);
  }
  void add(const YAML::Mark& mark, std::size_t nodes) {
    nodes_ += nodes;
    if (nodes_ > kMostNodes) fail(mark, "has too many values, or aliases (*) that grow; write fewer");
  }
  void leaf(const YAML::Mark& mark, YAML::anchor_t anchor) {
    add(mark, 1);
    if (anchor) sizes_[anchor] = 1;
  }
  void begin(const YAML::Mark& mark, YAML::anchor_t anchor) {
    open_.push_back({anchor, nodes_});
    add(mark, 1);
  }
  void end() {
    const Open closed = open_.back();
    open_.pop_back();
    if (closed.anchor) sizes_[closed.anchor] = nodes_ - closed.nodes_before;
  }

  const std::string& name_;
  int documents_ = 0;
  std::size_t nodes_ = 0;
  std::vector<Open> open_;
  std::map<YAML::anchor_t, std::size_t> sizes_;
};

}  // namespace

YAML::Node parseYamlDocument(const std::string& text, const std::string& name) {
  try {
    std::istringstream in(text);
    YAML::Parser parser(in);
    DocumentCheck check(name);
    // At most two documents: a stray comma or bracket at top level is an empty document for yaml-cpp, without end,
    // which YAML::LoadAll() never comes back from.
    for (int i = 0; i < 2 && parser.HandleNextDocument(check); ++i) {
    }
    return YAML::Load(text);
  } catch (const YAML::Exception& error) {
    throw InputError(name + ": line " + std::to_string(error.mark.line + 1) + ": not valid YAML (" + error.msg + ")");
  }
}

}  // namespace mmradartwin
