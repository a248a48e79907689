(** The LipSDP argument where the slopes of each neuron lie in a range [a, b] of its own: what a neuron adds to the
  quadratic form has the square of what enters it, so that the inputs stay in the matrix. *)
From Coq Require Import List Reals Lra Lia Psatz.
From Swarmcert Require Import Algebra Activations Form Network.
Import ListNotations.

Section Operations.
Context {T : Type} (zero : T) (add mul : T -> T -> T).
(** Upper rows of m diag(s) m'. *)
Fixpoint weighted_gram (s : list T) (m : list (list T)) : list (list T) :=
  match m with [] => [] | row :: m' => map (dot zero add mul (times mul s row)) m :: weighted_gram s m' end.
(** The ranges of slopes, the multipliers and the stage of each hidden layer. *)
Definition bent_layer := (list (T * T) * list T * list (list T))%type.
Definition ranges_of (k : bent_layer) := fst (fst k).
Definition multipliers_of (k : bent_layer) := snd (fst k).
Definition sums (r : list (T * T)) : list T := map (fun i => add (fst i) (snd i)) r.
Definition products (r : list (T * T)) : list T := map (fun i => mul (fst i) (snd i)) r.
(** A block m' diag(t a b) m for each of them, where what enters it stands; n numbers enter the first. *)
Fixpoint bends (n : nat) (hidden : list bent_layer) : list (list T) :=
  match hidden with
  | [] => []
  | (r, t, m) :: hidden' =>
      weighted_gram (times mul t (products r)) (columns zero n m) ++ bends (length t) hidden'
  end.
(** The multipliers, and diag(a + b) m. *)
Definition weighted (hidden : list bent_layer) :=
  map (fun k => (multipliers_of k, scale_rows mul (sums (ranges_of k)) (snd k))) hidden.
(** In (dx, dz_1, dz_2, ...), with t = rho / 2 for each input. *)
Definition bent_lmi (two minus_one : T) (t : list T) (hidden : list bent_layer) (last : list (list T)) :=
  sum add (band zero add mul two minus_one t (weighted hidden) last) (scale_all mul two (bends (length t) hidden)).
End Operations.

Section Morphism.
Context {S T : Type} (zero : S) (add mul : S -> S -> S) (zero' : T) (add' mul' : T -> T -> T) (f : S -> T)
  (f_zero : f zero = zero') (f_add : forall a b, f (add a b) = add' (f a) (f b))
  (f_mul : forall a b, f (mul a b) = mul' (f a) (f b)).
Notation F := (map f).
Notation FF := (map (map f)).
Lemma f_times u v : F (times mul u v) = times mul' (F u) (F v).
Proof. revert v. induction u as [|a u IH]; intros [|b v]; simpl; auto. now rewrite f_mul, IH. Qed.
Lemma f_weighted_gram s m : FF (weighted_gram zero add mul s m) = weighted_gram zero' add' mul' (F s) (FF m).
Proof.
  induction m as [|r m IH]; simpl; auto.
  rewrite IH, (f_dot zero add mul zero' add' mul' f f_zero f_add f_mul), f_times, !map_map. do 2 f_equal.
  apply map_ext. intros. now rewrite (f_dot zero add mul zero' add' mul' f f_zero f_add f_mul), f_times.
Qed.
Definition image_of_ranges := map (fun i : S * S => (f (fst i), f (snd i))).
Definition images := map (fun k : bent_layer => (image_of_ranges (ranges_of k), F (multipliers_of k), FF (snd k))).
Lemma f_sums r : F (sums add r) = sums add' (image_of_ranges r).
Proof. unfold sums, image_of_ranges. rewrite !map_map. apply map_ext. intros. apply f_add. Qed.
Lemma f_products r : F (products mul r) = products mul' (image_of_ranges r).
Proof. unfold products, image_of_ranges. rewrite !map_map. apply map_ext. intros. apply f_mul. Qed.
Lemma f_bends n hidden : FF (bends zero add mul n hidden) = bends zero' add' mul' n (images hidden).
Proof.
  revert n. induction hidden as [|[[r t] m] hidden IH]; intros n; simpl; auto. unfold ranges_of, multipliers_of. simpl.
  rewrite map_app, f_weighted_gram, (f_columns zero zero' f f_zero), f_times, f_products, IH, map_length. auto.
Qed.
Lemma f_weighted hidden : pairs f (weighted add mul hidden) = weighted add' mul' (images hidden).
Proof.
  unfold pairs, weighted, images, multipliers_of, ranges_of. rewrite !map_map. apply map_ext. intros [[r t] m]. simpl.
  now rewrite (f_scale_rows mul mul' f f_mul), f_sums.
Qed.
Lemma f_bent_lmi a b t hidden last : FF (bent_lmi zero add mul a b t hidden last) =
  bent_lmi zero' add' mul' (f a) (f b) (F t) (images hidden) (FF last).
Proof.
  unfold bent_lmi. now rewrite (f_sum add add' f f_add), (f_band zero add mul zero' add' mul' f f_zero f_add f_mul),
    (f_scale_all mul mul' f f_mul), f_bends, map_length, f_weighted.
Qed.
End Morphism.

Open Scope R_scope.
Notation weighted_gramR := (weighted_gram 0 Rplus Rmult).
Notation bendsR := (bends 0 Rplus Rmult).
Notation bent_lmiR := (bent_lmi 0 Rplus Rmult).

Lemma form_weighted_gram s m z :
  form (weighted_gramR s m) z = dotR (combine_rows z m) (timesR s (combine_rows z m)).
Proof.
  revert z. induction m as [|r m IH]; intros [|a z]; simpl; auto.
  set (c := combine_rows z m) in *.
  assert (dotR (map (dotR (timesR s r)) m) z = dotR c (timesR s r)) as ->.
  { unfold c. rewrite dot_combine, dot_comm. f_equal. unfold apply. apply map_ext. intros. apply dot_comm. }
  assert (forall u v, dotR u (timesR s v) = dotR (timesR s u) v) as D by (intros; symmetry; apply dot_times).
  set (p := plusR (scaleR a r) c).
  assert (forall u, dotR u p = a * dotR u r + dotR u c) as P
    by (intros; unfold p; now rewrite dot_plus_r, dot_scale_r).
  assert (forall u, dotR (timesR s p) u = a * dotR (timesR s u) r + dotR (timesR s u) c) as Q
    by (intros; now rewrite <- D, dot_comm, P).
  rewrite IH. fold c. rewrite (D p p), P, !Q, (dot_comm (timesR s r) c), <- (D c r), (D c c). ring.
Qed.
(** z' m' diag(s) m z. *)
Lemma form_bend s m z :
  form (weighted_gramR s (columnsR (length z) m)) z = dotR (applyR m z) (timesR s (applyR m z)).
Proof.
  rewrite form_weighted_gram. set (l := combine_rows z _).
  assert (forall w, dotR l w = dotR w (applyR m z)) as H by (intros; unfold l; now rewrite dot_combine, dot_columns).
  rewrite H, dot_times, H. apply dot_comm.
Qed.
Lemma length_weighted_gram s m : length (weighted_gramR s m) = length m.
Proof. induction m; simpl; auto. Qed.
(** Upper rows without entries beyond the diagonal block. *)
Lemma form_weighted_gram_app s m rest z z' : length m = length z ->
  form (weighted_gramR s m ++ rest) (z ++ z') = form (weighted_gramR s m) z + form rest z'.
Proof.
  revert z. induction m as [|r m IH]; intros [|a z]; simpl; try discriminate; intros H; [ring|].
  rewrite IH, dot_app_short by (rewrite ?map_length; lia). ring.
Qed.

(** A hidden layer with what the matrix takes of it. *)
Definition bent_as (k : (list R -> list R) * layer) (b : @bent_layer R) :=
  bias_fits (snd k) /\ snd b = weights k /\ fits (weights k) (multipliers_of b).

(** From h, h' on. *)
Lemma bent_layers t hidden bs last b h h' :
  length t = length h -> length h' = length h -> length b = length last -> Forall2 bent_as hidden bs ->
  along hidden (map ranges_of bs) h h' ->
  let dz := minus h h' in
  exists rest, form (bent_lmiR 2 (-1) t bs last) (dz ++ rest) <=
    2 * dotR dz (timesR t dz) - square (minus (network hidden (last, b) h) (network hidden (last, b) h')).
Proof.
  simpl. intros Ht Hh Hb H. revert t h h' Ht Hh. unfold bent_lmi.
  induction H as [|[f [m c]] [[r t2] m2] hidden bs (Hc & E & Ht2 & Hp2) H IH]; intros t h h' Ht Hh Hal.
  - exists []. rewrite app_nil_r, form_sum, form_scale. simpl. rewrite form_sum, form_scale, minus_affine by auto.
    assert (length (minus h h') = length t) as <- by (rewrite length_minus; auto).
    rewrite form_gram_columns, form_diagonal by (unfold scale; rewrite map_length, length_minus; auto).
    rewrite times_scale, dot_scale_r. lra.
  - unfold bias_fits, weights, ranges_of, multipliers_of in *. simpl in *. subst m2. destruct Hal as [Hf Hal].
    set (y := affine m c h) in *. set (y' := affine m c h') in *.
    assert (length y = length m) as Hy by (unfold y; now apply length_affine).
    assert (length y' = length m) as Hy' by (unfold y'; now apply length_affine).
    set (z := f y) in *. set (z' := f y') in *. destruct (increments_lengths _ _ _ _ _ Hf) as (Hr & _ & Lz & Lz').
    assert (length z = length m) as Hz by congruence. assert (length z' = length m) as Hz' by congruence.
    destruct (IH t2 z z') as [rest Hrest]; try congruence.
    exists (minus z z' ++ rest).
    assert (length (scale_rowsR (sums Rplus r) m) = length m) as Lw
      by (apply length_scale_rows; unfold sums; rewrite map_length; congruence).
    unfold multipliers_of, ranges_of. cbn [fst snd].
    rewrite form_sum, form_scale in Hrest |- *.
    assert (length (minus h h') = length t) as L by (rewrite length_minus; auto).
    rewrite <- L, form_block by (unfold scale; rewrite ?map_length, ?length_columns; auto).
    rewrite form_weighted_gram_app by apply length_columns. rewrite form_bend.
    rewrite dot_columns, (dot_comm (_ ++ _)), dot_app_short
      by (rewrite length_minus by congruence; unfold apply, scale_all;
          rewrite !map_length, length_scale_rows by congruence; lia).
    rewrite apply_scale_all, !apply_scale_rows, dot_scale_l, (dot_comm _ (minus z z')), !times_scale, !dot_scale_r.
    pose proof (increments_constraint r t2 y y' z z' Hf Hp2) as C. cbv zeta in C.
    unfold y, y' in C. rewrite minus_affine in C by auto.
    change (sums_of r) with (sums Rplus r) in C. change (products_of r) with (products Rmult r) in C. lra.
Qed.

Theorem bent_lmi_bounds rho n hidden bs last b x x' : bias_fits (last, b) -> Forall2 bent_as hidden bs ->
  along hidden (map ranges_of bs) x x' -> nonnegative (bent_lmiR 2 (-1) (repeat (rho / 2) n) bs last) ->
  length x = n -> length x' = n ->
  square (minus (network hidden (last, b) x) (network hidden (last, b) x')) <= rho * square (minus x x').
Proof.
  intros Hb H Hal HP Hx Hx'. destruct (bent_layers (repeat (rho / 2) n) hidden bs last b x x') as [rest G]; auto.
  - now rewrite repeat_length.
  - congruence.
  - specialize (HP (minus x x' ++ rest)). set (d := minus x x') in *.
    assert (length d = n) as L by (unfold d; rewrite length_minus; congruence).
    assert (2 * dotR d (timesR (repeat (rho / 2) n) d) = rho * square d) as E; [|lra].
    rewrite <- L. unfold square. clear. induction d as [|a d IH]; simpl; [ring|]. nra.
Qed.
