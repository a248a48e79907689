(* NET: its networks by name ("network", "phi:<kind>", "rho:<kind>"), units, input order and clamp. *)

open Refusal

type t = {
  sha256 : string;  (* of network.toml; else "" *)
  unit : string;
  order : string list;
  invariants : bool;  (* the phi of set functions see rotation invariants *)
  clamp : (float * float) list;  (* [] : none *)
  silent : (string * string list) list;
    (* kinds of a vehicle and of the neighbours among which it has no network, sorted *)
  parts : (string * Weights.t) list;  (* by name, sorted *)
}

type arguments = {
  net : string;
  phi : string;
  rho : string;
  key : string;
  orders : (string * string list) list;
  activation : string;  (* names, separated by commas; "": not stated *)
}

let sha256_of bytes = Sha256.to_hex (Sha256.string bytes)
(* Formats that hold one network and no keys, in the order in which every checker looks for them. *)
let flat_formats = [
  "safetensors", Safetensors.looks_like, (fun path bytes ~order -> Safetensors.read path bytes ~order);
  "ONNX", Onnx_model.looks_like, (fun path bytes ~order -> Onnx.read path bytes ~order);
  ".mat", Mat_file.looks_like, (fun path bytes ~order ->
      Weights.assemble ~path ~sha256:(sha256_of bytes) Layer_order.Unordered ~order (Mat_file.read path bytes));
  ".nnet", Nnet.looks_like, (fun path bytes ~order ->
      Weights.assemble ~path ~sha256:(sha256_of bytes) Layer_order.Evaluation ~order (Nnet.read path bytes)) ]
let npz = ".npz", Named_arrays.looks_like_npz, (fun path bytes ~order ->
    Weights.assemble ~path ~sha256:(sha256_of bytes) Layer_order.Unordered ~order (Named_arrays.read_npz path bytes))

let load_bytes path bytes ~key ~order =
  let is_of (_, looks_like, _) = looks_like bytes in
  let read (format, _, read) =
    if key <> "" then bad_input "%s: %s files are not nested: leave --key out" path format;
    read path bytes ~order in
  if is_of npz then read npz
  else if Pth.looks_like bytes then Pth.read path bytes ~key ~order
  else match List.find_opt is_of flat_formats with
    | Some format -> read format
    | None when C_source.looks_like bytes -> C_source.read path bytes ~key ~order
    | None -> bad_input "%s: is no weight file: neither a PyTorch state dict, safetensors, ONNX, .npz, .mat, .nnet nor \
                         generated C source" path
let load path ~key ~order =
  match String.rindex_opt path '#' with
  | Some mark when mark + 1 < String.length path && not (Sys.file_exists path) ->
    if key <> "" then bad_input "%s: the name of the file already names a key" path;
    let file = String.sub path 0 mark in
    load_bytes file (contents file) ~key:(String.sub path (mark + 1) (String.length path - mark - 1)) ~order
  | _ -> load_bytes path (contents path) ~key ~order

let is_clamped part = part = "network" || (String.length part >= 4 && String.sub part 0 4 = "phi:" && part <>
    "phi:ground")
let sizes weights = Weights.inputs (Weights.first_layer weights), Weights.outputs (Weights.last_layer weights)

(* network.toml *)

let allow_only path where keys members =
  List.iter (fun (key, _) -> if not (List.mem key keys) then bad_input
      "%s: %s%s is not a known key" path where (shown key)) members
let table path name = function
  | Some (Json.Object members) -> members
  | Some _ -> bad_input "%s: %s must be a table" path name
  | None -> bad_input "%s: %s is missing" path name
let text path name = function Some (Json.Text s) -> s | _ -> bad_input "%s: %s must be text in quotes" path name
let texts path name = function
  | Json.Array elements -> List.map (fun e -> text path name (Some e)) elements
  | _ -> bad_input "%s: %s must be a list of texts in quotes" path name
let numbers path name = function
  | Some (Json.Array elements) ->
    List.map (function Json.Number { value; _ } -> value | _ -> bad_input "%s: %s must be a list of numbers" path name)
        elements
  | _ -> bad_input "%s: %s must be a list of numbers" path name

let read_output path members =
  allow_only path "output." [ "quantity"; "unit" ] members;
  let quantity = text path "output.quantity" (List.assoc_opt "quantity" members) in
  let unit = text path "output.unit" (List.assoc_opt "unit" members) in
  let units = match quantity with
    | "force_z" | "force" -> [ "gf"; "N" ] | "torque" -> [ "mN_m"; "N_m" ]
    | _ -> bad_input "%s: output.quantity is not one of the possible values" path in
  if not (List.mem unit units) then bad_input "%s: output.unit is not one of the possible values" path;
  unit, Some quantity

let relative_state = [ "dp_x_m"; "dp_y_m"; "dp_z_m"; "dv_x_m_s"; "dv_y_m_s"; "dv_z_m_s" ]
let invariants_of_neighbour = 5
let invariants_of_ground = 3

let read_input path members =
  allow_only path "input." [ "order"; "invariants"; "clamp" ] members;
  let order = match List.assoc_opt "order" members with None -> [] | Some json ->
    let names = texts path "input.order" json in
    if names = [] || List.length (List.sort_uniq compare names) <> List.length names then
      bad_input "%s: input.order is empty or names an input twice" path;
    names in
  let invariants = match List.assoc_opt "invariants" members with
    | None -> false
    | Some (Json.Text "rotation") when order = relative_state -> true
    | Some (Json.Text "rotation") -> bad_input "%s: input.order: invariants are made from a relative state" path
    | _ -> bad_input "%s: input.invariants is not one of the possible values" path in
  let clamp = match List.assoc_opt "clamp" members with None -> [] | json ->
    let members = table path "input.clamp" json in
    allow_only path "input.clamp." [ "lower"; "upper" ] members;
    let lower = numbers path "input.clamp.lower" (List.assoc_opt "lower" members) in
    let upper = numbers path "input.clamp.upper" (List.assoc_opt "upper" members) in
    let count = if invariants then invariants_of_neighbour
      else if order = [] then List.length lower else List.length order in
    if count = 0 || List.length lower <> count || List.length upper <> count then
      bad_input "%s: input.clamp needs %d numbers each" path count;
    if not (List.for_all2 ( <= ) lower upper) then bad_input "%s: input.clamp: lower is above upper" path;
    List.combine lower upper in
  order, invariants, clamp

let read_gamma path members =
  allow_only path "gamma." [ "value"; "scope"; "mode" ] members;
  let choice key words = if not (List.mem (text path ("gamma." ^ key) (List.assoc_opt key members)) words) then
      bad_input "%s: gamma.%s is not one of the possible values" path key in
  choice "scope" [ "layer"; "network" ]; choice "mode" [ "clip"; "equal" ];
  match List.assoc_opt "value" members with
  | Some (Json.Number { value; _ }) when value > 0. -> ()
  | _ -> bad_input "%s: gamma.value must be positive" path

(* What `field` states beside the weights, in names that `called` knows. *)
let with_activations field called (weights : Weights.t) names =
  let called name = match called name with
    | Some activation -> activation | None -> bad_input "%s: there is no activation %s" field (shown name) in
  if names = [] then bad_input "%s: names no activation" field;
  let stated = List.map called names in
  let is_written = not (List.for_all Piecewise.is_itself stated) in
  let within = List.map (fun (a : Piecewise.t) -> a.within) stated in
  match Weights.with_activations weights within, weights.activations with
  | Some found, (None | Some []) -> if is_written then Piecewise.written found stated else found
  | Some found, Some _ when not is_written -> found
  | _, Some (_ :: _ as others) ->
    bad_input "%s: %s: %s is stated already" weights.path field (String.concat ", " (List.map Activation.name others))
  | _, _ ->
    bad_input "%s: %s: %d activations do not fit the %d layers, or a group the size of its layer" weights.path field
      (List.length names) (List.length weights.layers)

let read_kinds path ~key role members =
  if members = [] then bad_input "%s: %s names no kind of vehicle" path role;
  List.map (fun (kind, json) ->
      let where = role ^ "." ^ kind in
      let entry = table path where (Some json) in
      allow_only path (where ^ ".") [ "weights"; "order"; "activation" ] entry;
      if String.contains kind ':' then bad_input "%s: a kind's name must not contain ':'" path;
      let file = text path (where ^ ".weights") (List.assoc_opt "weights" entry) in
      if file = "" || String.contains file '\000' then bad_input "%s: %s.weights is not the name of a file" path where;
      let order = match List.assoc_opt "order" entry with None -> [] | Some json ->
        let names = texts path (where ^ ".order") json in
        if names = [] then bad_input "%s: %s.order names no layer" path where; names in
      let file = if Filename.is_relative file then Filename.concat (Filename.dirname path) file else file in
      let weights = load file ~key ~order in
      let weights = match List.assoc_opt "activation" entry with
        | None -> weights
        | Some json ->
          let here = where ^ ".activation" in
          let names = match json with Json.Array _ -> texts path here json | _ -> [ text path here (Some json) ] in
          let called name = Option.map Piecewise.that_is (Activation.called name) in
          with_activations (path ^ ": " ^ here) called weights names in
      role ^ ":" ^ kind, weights) members

let check_sizes path ~order ~invariants ~clamp ~components phis rhos =
  let refuse name what = bad_input "%s: %s: does not fit the other networks (%s)" path name what in
  let hidden = snd (sizes (snd (List.hd phis))) and outputs = snd (sizes (snd (List.hd rhos))) in
  let stated = if invariants then invariants_of_neighbour
    else if order <> [] then List.length order else List.length clamp in
  let inputs = ref stated in
  List.iter (fun (name, w) ->
      let i, o = sizes w in
      if o <> hidden then refuse name "outputs";
      if name = "phi:ground" then begin
        let inputs = if invariants then invariants_of_ground else 4 in
        if i <> inputs then refuse name (Printf.sprintf "the ground's network has %d inputs" inputs)
      end
      else (if !inputs = 0 then inputs := i; if i <> !inputs then refuse name "inputs")) phis;
  List.iter (fun (name, w) ->
      let i, o = sizes w in
      if i <> hidden then refuse name "inputs";
      if o <> outputs || (components <> None && components <> Some o) then refuse name "outputs") rhos

let read_silent path phis rhos json =
  let names = texts path "silent" json in
  if names = [] then bad_input "%s: silent: names no composition" path;
  let composition name =
    let refuse what = bad_input "%s: silent: %s: %s" path (shown name) what in
    match String.index_opt name '>' with
    | None -> refuse "is not a composition"
    | Some arrow ->
      let own = String.sub name (arrow + 1) (String.length name - arrow - 1) in
      if not (List.mem_assoc ("rho:" ^ own) rhos) then refuse ("there is no rho." ^ own);
      let kinds = if arrow = 0 then [] else String.split_on_char '+' (String.sub name 0 arrow) in
      List.iter (fun kind -> if kind = "ground" || not (List.mem_assoc ("phi:" ^ kind) phis) then
          refuse ("there is no phi." ^ kind ^ " of a neighbour")) kinds;
      own, List.sort String.compare kinds in
  let compositions = List.map composition names in
  let sorted = List.sort_uniq compare compositions in
  if List.length sorted < List.length names then bad_input "%s: silent: names a composition twice" path;
  sorted

let read_toml path bytes ~key =
  let members = match Toml.parse path bytes with Json.Object m -> m | _ -> assert false in
  if List.assoc_opt "schema" members <> Some (Json.Text "swarmcert/network/1") then
    bad_input "%s: schema must be \"swarmcert/network/1\"" path;
  allow_only path "" [ "schema"; "output"; "gamma"; "input"; "silent"; "phi"; "rho" ] members;
  let optional name absent read = match List.assoc_opt name members with
    | None -> absent | json -> read path (table path name json) in
  let unit, quantity = optional "output" ("", None) read_output in
  let components = Option.map (fun quantity -> if quantity = "force_z" then 1 else 3) quantity in
  optional "gamma" () read_gamma;
  let order, invariants, clamp = optional "input" ([], false, []) read_input in
  if invariants && quantity <> Some "force_z" then bad_input "%s: input.invariants are for a vertical force" path;
  let kinds role = read_kinds path ~key role (table path role (List.assoc_opt role members)) in
  let phis = kinds "phi" in
  let rhos = kinds "rho" in
  check_sizes path ~order ~invariants ~clamp ~components phis rhos;
  let sorted = List.sort (fun (a, _) (b, _) -> String.compare a b) (phis @ rhos) in
  let silent = Option.fold ~none:[] ~some:(read_silent path phis rhos) (List.assoc_opt "silent" members) in
  { sha256 = Sha256.to_hex (Sha256.string bytes); unit; order; invariants; clamp; silent; parts = sorted }

let plain parts = { sha256 = ""; unit = ""; order = []; invariants = false; clamp = []; silent = []; parts }
let read_stated { net; phi; rho; key; orders; _ } =
  let order part = Option.value ~default:[] (List.assoc_opt part orders) in
  if phi <> "" then begin
    let p = load phi ~key ~order:(order "phi") and r = load rho ~key ~order:(order "rho") in
    if snd (sizes p) <> fst (sizes r) then bad_input "%s: does not take as many inputs as %s has outputs" rho phi;
    plain [ "phi:default", p; "rho:default", r ]
  end
  else if Filename.check_suffix net ".toml" then begin
    if orders <> [] then bad_input "%s: --order is of one weight file, and this names several" net;
    read_toml net (contents net) ~key
  end
  else plain [ "network", load net ~key ~order:(order "network") ]
let read arguments =
  let net = read_stated arguments in
  let names = String.split_on_char ',' arguments.activation in
  let stated (name, weights) = name, with_activations "--activation" Piecewise.called weights names in
  if arguments.activation = "" then net else { net with parts = List.map stated net.parts }

let as_float32 net = { net with parts = List.map (fun (name, w) -> name, Weights.as_float32 w) net.parts }
