(* A whole certificate, in the order in which the C++ checker looks at it. *)

open Refusal
open Json

let check_chain net part stated where =
  let here = where ^ ".chain" in
  let expected = Functions.chain net part in
  let fits step (o : Functions.operation) =
    require_keys here [ "op"; "layer"; "inputs"; "outputs" ] step;
    let is key value = match find here key step with
      | Number { value = v; is_integer = true } -> v = float_of_int value | _ -> false in
    find here "op" step = Text o.op && find here "layer" step = (match o.layer with Some l -> Text l | None -> Null)
    && is "inputs" o.from && is "outputs" o.onto in
  let is_equal = match stated with
    | Array steps -> List.length steps = List.length expected && List.for_all2 fits steps expected | _ -> false in
  require is_equal "%s is not the one of this network: %s" here (Functions.chain_words expected)

let is_hash = function
  | Text s -> String.length s = 64 && String.for_all (fun c -> (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f')) s
  | _ -> false

(* The form only: the samples are not here. *)
let check_samples samples where =
  if samples <> Null then begin
    require_keys where [ "sha256"; "count"; "tolerance"; "tolerance_hex"; "largest_deviation";
        "largest_deviation_hex" ] samples;
    require (is_hash (find where "sha256" samples)) "%s.sha256 is not a hash" where;
    let positive = match find where "count" samples with Number { value; is_integer = true } -> value >= 1. | _ ->
        false in
    require positive "%s.count is not positive" where;
    let number key = Exact.number (where ^ "." ^ key) (find where key samples) (find where (key ^ "_hex") samples) in
    let tolerance = number "tolerance" in
    require (number "largest_deviation" <= tolerance) "%s: the largest deviation is above the tolerance" where
  end

let check_weights (net : Network.t) named =
  require_keys "network" [ "description_sha256"; "options"; "output"; "input"; "silent"; "weights"; "as" ] named;
  let as_ = find "network" "as" named in
  require (as_ = Null || as_ = Text "float32") "network.as is unknown";
  let weights = find "network" "weights" named in
  List.iter (fun (name, (w : Weights.t)) ->
      let where = "network.weights." ^ name in
      let entry = find "network.weights" name weights in
      require_keys where [ "file"; "sha256"; "data_files"; "precision"; "assumed"; "chain"; "layers"; "samples" ] entry;
      require (as_ = Null || w.precision = "float32") "%s: is not of float32, as network.as states" where;
      check_chain net name (find where "chain" entry) where;
      check_samples (find where "samples" entry) (where ^ ".samples")) net.parts

let check_boxes net boxes =
  match boxes with
  | Null -> ()
  | Object (_ :: _ as boxes) ->
    List.iter (fun (part, box) ->
        let where = "box." ^ shown part in
        require (List.mem_assoc part net.Network.parts && not (Functions.starts_with "rho:" part))
            "%s does not belong to a network with a box" where;
        require_keys where [ "lower"; "upper" ] box;
        let lower = Exact.hex_floats where (find where "lower" box) and upper =
            Exact.hex_floats where (find where "upper" box) in
        let inputs = Functions.inputs net part in
        require (List.length lower = inputs && List.length upper = inputs) "%s has another size" where;
        require (List.for_all2 ( <= ) lower upper) "%s is empty" where) boxes
  | _ -> rejected "box is neither null nor an object with boxes"

(* `json`: an object of the schema, made for `files`. Raises Rejected. *)
let check files json =
  let net = Network.canonical (find "certificate" "network" json) in
  Network.require_files net files;
  require_keys "certificate"
    [ "schema"; "tool"; "statement"; "network"; "box"; "layers"; "bounds"; "laws"; "values"; "content_sha256" ] json;
  let member key = find "certificate" key json in
  let some property = List.exists (fun (_, w) -> List.exists property (Weights.between w)) net.parts in
  let text = Statement.text ~sorts:(some Activation.sorts) ~keeps:(some Activation.keeps)
      ~silent_names:(Functions.silent_names net) in
  require (member "statement" = Text text)
    "statement is not the one that is checked";
  let rest = List.filter (fun (key, _) -> key <> "content_sha256") (members "certificate" json) in
  require (member "content_sha256" = Text (Sha256.to_hex (Sha256.string (encode (Object rest)))))
    "content_sha256 does not match: the certificate was changed after it was written";
  (match member "tool" with Text _ -> () | _ -> rejected "tool is not text");
  check_weights net (member "network");
  check_boxes net (member "box");
  let state = { Claims.net; json; parts = Functions.parts net; accepted = []; log = []; norms = Hashtbl.create 8;
                uppers = Hashtbl.create 64; in_box = Hashtbl.create 8; unwritten = 0; spectral_norms = 0;
                upper_bounds = 0; lower_bounds = 0; values = 0; not_checked = [] } in
  List.iter (fun (part, (w : Weights.t)) ->
      List.iteri (fun k layer ->
          Claims.check_layer state (element "layers" state.spectral_norms (member "layers")) part k layer) w.layers)
              net.parts;
  require (List.length (list "layers" (member "layers")) = state.spectral_norms)
      "layers lists more than the networks have";
  let bounds = match member "bounds" with Array (_ :: _ as bounds) -> bounds | _ -> rejected "bounds is empty" in
  let laws = match member "laws" with Array laws -> laws | _ -> rejected "laws is not an array" in
  List.iter (Claims.check_bound state) bounds;
  List.iter (Claims.check_law state) laws;
  (match member "values" with
   | Array values -> List.iter (Values.check state) values
   | _ -> rejected "values is not an array");
  state
