(* The network in a certificate: its networks by name ("network", "phi:<kind>", "rho:<kind>"), units, input order and
   clamp. What it reads is what every claim is about; that the files hold it is not decided here, only that they are
   the files with the hashes that the certificate names. *)

open Refusal
open Json

type t = {
  sha256 : string;  (* of network.toml; else "" *)
  unit : string;
  order : string list;
  clamp : (float * float) list;  (* [] : none *)
  silent : (string * string list) list;
    (* kinds of a vehicle and of the neighbours among which it has no network, sorted *)
  parts : (string * Weights.t) list;  (* by name, sorted *)
}

let is_clamped part = part = "network" || (String.starts_with ~prefix:"phi:" part && part <> "phi:ground")
let sizes weights = Weights.inputs (Weights.first_layer weights), Weights.outputs (Weights.last_layer weights)

let texts where json = List.map (Json.text where) (list where json)
let floats where json = List.map Exact.parse_hex_float (Exact.words (text where json))

let layer where json =
  require_keys where [ "name"; "tensor"; "weights"; "biases"; "weight_rounding"; "bias_rounding" ] json;
  (match find where "tensor" json with Null | Text _ -> () | _ -> rejected "%s: tensor is not text" where);
  List.iter (fun key -> require (Exact.hex_float where (find where key json) >= 0.) "%s: a rounding is negative" where)
    [ "weight_rounding"; "bias_rounding" ];
  let row json = Array.of_list (floats where json) in
  let weights = Array.of_list (List.map row (list where (find where "weights" json))) in
  let biases = Array.of_list (floats where (find where "biases" json)) in
  require (Array.length weights > 0 && Array.length biases = Array.length weights) "%s: not one bias per row" where;
  let size = Array.length weights.(0) in
  let is_full row = Array.length row = size in
  require (size > 0 && Array.for_all is_full weights) "%s: rows of different lengths" where;
  { Weights.name = text where (find where "name" json); weights; biases }

(* The activation behind a layer with so many outputs. *)
let activation where outputs op =
  let found = match Activation.called op, String.rindex_opt op ':' with
    | None, Some mark ->
      let digits = String.sub op (mark + 1) (String.length op - mark - 1) in
      let is_digit c = c >= '0' && c <= '9' in
      let is_count = digits <> "" && String.length digits < 9 && String.for_all is_digit digits in
      (match Activation.called (String.sub op 0 mark) with
       | Some changed when is_count && changed <> Proved.Relu && not (Activation.sorts changed) ->
         let n = int_of_string digits in
         if 0 < n && n < outputs then Some (Proved.Keeping (n, changed)) else None
       | _ -> None)
    | found, _ -> found in
  match found with
  | Some a -> require (outputs mod Activation.group a = 0) "%s: a layer does not fit %s" where (shown op); a
  | None -> rejected "%s: unknown operation %s" where (shown op)

let weights where json =
  let find key = find where key json in
  let layers = List.map (layer (where ^ ".layers")) (list where (find "layers")) in
  require (layers <> [] && List.length layers <= 10000) "%s.layers is empty or too long" where;
  let op step = text where (Json.find where "op" step) in
  let ops = List.filter (fun op -> op <> "linear" && op <> "clamp") (List.map op (list where (find "chain"))) in
  require (List.length ops + 1 = List.length layers) "%s.chain has another number of activations than its layers" where;
  let hidden = List.filteri (fun k _ -> k + 1 < List.length layers) layers in
  let activations = List.map2 (fun l op -> activation (where ^ ".chain") (Weights.outputs l) op) hidden ops in
  List.iter2 (fun before after -> require (Weights.outputs before = Weights.inputs after)
      "%s.layers do not fit one another" where) hidden (List.tl layers);
  let precision = text where (find "precision") in
  require (precision = "float32" || precision = "float64") "%s: unknown precision" where;
  let is_float32 x = Exact.float32 x = x in
  let holds (l : Weights.layer) =
    Array.for_all (Array.for_all is_float32) l.weights && Array.for_all is_float32 l.biases in
  require (precision <> "float32" || List.for_all holds layers) "%s: a number is no float32" where;
  ignore (texts where (find "assumed"));
  let data_files = List.map (fun (name, hash) -> name, text where hash) (members where (find "data_files")) in
  { Weights.file = text where (find "file"); sha256 = text where (find "sha256"); data_files; precision; layers;
    activations }

let read_clamp = function
  | Null -> []
  | json ->
    let where = "network.input.clamp" in
    require_keys where [ "lower"; "upper" ] json;
    let side key = Exact.hex_floats where (find where key json) in
    let lower = side "lower" and upper = side "upper" in
    require (lower <> [] && List.length lower = List.length upper) "%s has other sizes" where;
    require (List.for_all2 ( <= ) lower upper) "%s is empty" where;
    List.combine lower upper

let require_consistent net quantity =
  let fits holds = require holds "network: its parts do not fit one another" in
  let named prefix = List.filter (fun (name, _) -> String.starts_with ~prefix name) net.parts in
  let phis = named "phi:" and rhos = named "rho:" in
  let stated = List.length net.order and clamped = List.length net.clamp in
  fits (stated = 0 || clamped = 0 || stated = clamped);
  let inputs = ref (if stated > 0 then stated else clamped) in
  match net.parts with
  | [ "network", w ] ->
    fits (net.silent = [] && (!inputs = 0 || !inputs = fst (sizes w)))
  | parts ->
    fits (phis <> [] && rhos <> [] && List.length phis + List.length rhos = List.length parts);
    let hidden = snd (sizes (snd (List.hd phis))) and outputs = snd (sizes (snd (List.hd rhos))) in
    List.iter (fun (name, w) ->
        let i, o = sizes w in
        fits (o = hidden);
        if name = "phi:ground" then fits (i = 4)
        else (if !inputs = 0 then inputs := i; fits (i = !inputs))) phis;
    let components = match quantity with "" -> 0 | "force_z" -> 1 | _ -> 3 in
    List.iter (fun (_, w) -> fits (sizes w = (hidden, outputs) && (components = 0 || components = outputs))) rhos

(* "large+small>small", with kinds that the network has, sorted. *)
let composition net name =
  match String.index_opt name '>' with
  | None -> rejected "network.silent: %s is not a composition" (shown name)
  | Some arrow ->
    let own = String.sub name (arrow + 1) (String.length name - arrow - 1) in
    require (List.mem_assoc ("rho:" ^ own) net.parts) "network.silent: %s is not a composition" (shown name);
    let kinds = if arrow = 0 then [] else String.split_on_char '+' (String.sub name 0 arrow) in
    List.iter (fun kind -> require (kind <> "ground" && List.mem_assoc ("phi:" ^ kind) net.parts)
        "network.silent: there is no phi of %s" (shown kind)) kinds;
    require (List.sort String.compare kinds = kinds) "network.silent: kinds are not sorted";
    own, kinds

(* With which the files were read, for the reader of files; their form only. *)
let check_options json =
  let where = "network.options" in
  let lists = [ "order"; "phi_order"; "rho_order"; "select" ] and words = [ "key"; "activation" ] in
  let words = if Json.has "normalization" json then "normalization" :: words else words in
  require_keys where (lists @ words) json;
  List.iter (fun key -> ignore (texts where (Json.find where key json))) lists;
  List.iter (fun key -> ignore (text where (Json.find where key json))) words

(* `json`: the member "network" of a certificate. *)
let canonical json =
  let where = "network" in
  let find key = Json.find where key json in
  let output = find "output" and input = find "input" in
  check_options (find "options");
  require_keys "network.output" [ "quantity"; "unit" ] output;
  require_keys "network.input" [ "order"; "clamp" ] input;
  let quantity = text where (Json.find where "quantity" output) in
  let order = texts where (Json.find where "order" input) in
  require (List.length (List.sort_uniq compare order) = List.length order) "network.input names one twice";
  let is_network name =
    let is_of prefix = String.starts_with ~prefix name && not (String.contains_from name 4 ':') in
    name = "network" || List.exists is_of [ "phi:"; "rho:" ] in
  let part (name, entry) =
    require (is_network name) "network.weights: %s is no network" (shown name);
    name, weights ("network.weights." ^ name) entry in
  let parts = List.sort (fun (a, _) (b, _) -> String.compare a b) (List.map part (members where (find "weights"))) in
  let net = { sha256 = text where (find "description_sha256"); unit = text where (Json.find where "unit" output); order;
              clamp = read_clamp (Json.find where "clamp" input); silent = []; parts } in
  let compositions = List.map (composition net) (texts where (find "silent")) in
  let silent = List.sort_uniq compare compositions in
  require (List.length silent = List.length compositions) "network.silent names a composition twice";
  require_consistent { net with silent } quantity;
  { net with silent }

(* The files that are given as NET. *)
type files = Described of string (* network.toml, or one weight file *) | Pair of string * string (* phi, rho *)

let hashes = Hashtbl.create 8
let sha256_of path = match Hashtbl.find_opt hashes path with
  | Some hash -> hash
  | None ->
    let hash = Sha256.to_hex (Sha256.string (contents path)) in
    Hashtbl.add hashes path hash; hash

(* "FILE#KEY" where there is no such file is FILE. *)
let without_key path = match String.rindex_opt path '#' with
  | Some mark when not (Sys.file_exists path) -> String.sub path 0 mark
  | _ -> path

(* Raises Rejected unless these are the files that the network was read from, by their hashes. *)
let require_files net files =
  let beside path name = if Filename.is_relative name then Filename.concat (Filename.dirname path) name else name in
  let path_of part (w : Weights.t) = match files with
    | Described path -> if net.sha256 = "" then without_key path else beside path w.file
    | Pair (phi, rho) -> if part = "phi:default" then phi else rho in
  let description = match files with Described path when net.sha256 <> "" -> sha256_of path | _ -> net.sha256 in
  let names = List.map fst net.parts in
  let fits = match files with
    | Described _ -> description = net.sha256 && (net.sha256 <> "" || names = [ "network" ])
    | Pair _ -> net.sha256 = "" && names = [ "phi:default"; "rho:default" ] in
  require fits "network.description_sha256 differs: the certificate was made for another network";
  List.iter (fun (part, (w : Weights.t)) ->
      let path = path_of part w in
      let holds (name, hash) = sha256_of (beside path name) = hash in
      require (sha256_of path = w.sha256 && List.for_all holds w.data_files)
        "network.weights.%s differs: the certificate was made for other weights than %s" part path) net.parts
