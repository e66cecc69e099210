# Every target installs what it needs first. See CONTRIBUTING for what runs when.
CARGO ?= cargo

SCENE ?= scenes/ajar/ajar.pbrt

.PHONY: all render study verify-double test test-long try-engines bench replay lint deps clean

all: deps
	$(CARGO) build --release

# The picture of this project: Veach's door, a little open.
render: all
	mkdir -p out
	target/release/metrolux render scenes/ajar/ajar.pbrt -o out/ajar.exr -o out/ajar.png

# What accuracy costs in time, a page for each of four scenes: out/study/NAME/index.html. Goes on where it stopped. Two at
# once on a machine of two cores: make -j2 study STUDY_OPTIONS='--clock cpu' STUDY_RENDER='--threads 1'
STUDY_BUDGET ?= 10m
STUDY_OPTIONS ?=
STUDY_RENDER ?=
STUDIES = $(addprefix study/,ajar/ajar caustic/caustic-x1 pool/pool cornell/cornell)

.PHONY: $(STUDIES)
study: $(STUDIES)

$(STUDIES): study/%: all
	target/release/metrolux study scenes/$*.pbrt -o out/study/$(notdir $*) --budget $(STUDY_BUDGET) $(STUDY_OPTIONS) \
		-- --resolution $(if $(findstring ajar,$*),128x72,96x96) $(STUDY_RENDER)

# By how much f32 deviates from f64 on each scene, in out/double: steps of the one build made again by the other.
DOUBLE = target/double/release/metrolux
DOUBLE_STEPS ?= 1000
DOUBLE_OPTIONS ?=
DOUBLE_SCENES = ajar/ajar $(foreach z,1 4 16 64,caustic/caustic-x$z) cornell/cornell cornell-glass/cornell-glass \
	$(addprefix furnace/,emission four-points point) pool/pool prism/prism

.PHONY: $(DOUBLE)
$(DOUBLE): deps
	$(CARGO) build --release --features double --target-dir target/double

verify-double: all $(DOUBLE)
	mkdir -p out/double
	for s in $(DOUBLE_SCENES); do n=out/double/$${s#*/}; \
		target/release/metrolux verify scenes/$$s.pbrt $(DOUBLE_OPTIONS) --steps $(DOUBLE_STEPS) --keep-steps $$n.steps > $$n.verify \
		|| echo "see $$n.verify"; $(DOUBLE) verify scenes/$$s.pbrt $(DOUBLE_OPTIONS) --against $$n.steps > $$n.txt; c=$$?; \
		echo "$$s"; cat $$n.txt; [ $$c = 0 ] || exit $$c; done

test: deps
	$(CARGO) test

# Tests that take minutes, among them those marked #[ignore], but for one that writes files of the repository; and the modules
# with transport in f64.
test-long: $(DOUBLE)
	METROLUX_DOUBLE=$(CURDIR)/$(DOUBLE) $(CARGO) test --release -- --include-ignored --skip write_the_corpus
	$(CARGO) test --release --lib --features double --target-dir target/double

# Jobs of `metrolux job` on the engines themselves, where they are installed.
try-engines: all
	bash tests/engines/slurm.sh
	bash tests/engines/openjd.sh

bench: deps
	$(CARGO) bench

# What a render costs over the bare Embree calls it makes: make replay SCENE=FILE
replay: deps
	METROLUX_SCENE="$(SCENE)" $(CARGO) bench --bench replay

lint: deps
	$(CARGO) fmt --check
	$(CARGO) clippy --all-targets -- -D warnings
	$(CARGO) clippy --features double -- -D warnings

deps:
	@sh ffi/install-deps.sh

clean:
	$(CARGO) clean
