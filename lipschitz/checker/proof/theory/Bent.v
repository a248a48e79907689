(** The LipSDP argument where slopes lie in [1 - c, c]: what a layer's functions add to the quadratic form is a multiple
  of the square of what enters them, so that the inputs stay in the matrix. *)
From Coq Require Import List Reals Lra Lia Psatz.
From Swarmcert Require Import Algebra Activations Form Network.
Import ListNotations.

Section Operations.
Context {T : Type} (zero : T) (add mul : T -> T -> T).
(** Upper rows of m diag(s) m'. *)
Fixpoint weighted_gram (s : list T) (m : list (list T)) : list (list T) :=
  match m with [] => [] | row :: m' => map (dot zero add mul (times mul s row)) m :: weighted_gram s m' end.
(** The g, the multipliers and the stage of each hidden layer. *)
Definition bent_layer := (T * list T * list (list T))%type.
(** A block m' diag(g t) m for each of them, where what enters it stands; n numbers enter the first. *)
Fixpoint bends (n : nat) (hidden : list bent_layer) : list (list T) :=
  match hidden with
  | [] => []
  | (g, t, m) :: hidden' => weighted_gram (scale mul g t) (columns zero n m) ++ bends (length t) hidden'
  end.
Definition unbent (hidden : list bent_layer) := map (fun k => (snd (fst k), snd k)) hidden.
(** In (dx, dz_1, dz_2, ...), with t = rho / 2 for each input. *)
Definition bent_lmi (two minus_one minus_two : T) (t : list T) (hidden : list bent_layer) (last : list (list T)) :=
  sum add (band zero add mul two minus_one t (unbent hidden) last)
    (scale_all mul minus_two (bends (length t) hidden)).
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
Definition images := map (fun k : bent_layer => (f (fst (fst k)), F (snd (fst k)), FF (snd k))).
Lemma f_bends n hidden : FF (bends zero add mul n hidden) = bends zero' add' mul' n (images hidden).
Proof.
  revert n. induction hidden as [|[[g t] m] hidden IH]; intros n; simpl; auto.
  rewrite map_app, f_weighted_gram, (f_columns zero zero' f f_zero), (f_scale mul mul' f f_mul), IH, map_length. auto.
Qed.
Lemma f_bent_lmi a b c t hidden last : FF (bent_lmi zero add mul a b c t hidden last) =
  bent_lmi zero' add' mul' (f a) (f b) (f c) (F t) (images hidden) (FF last).
Proof.
  unfold bent_lmi. rewrite (f_sum add add' f f_add), (f_band zero add mul zero' add' mul' f f_zero f_add f_mul),
    (f_scale_all mul mul' f f_mul), f_bends, map_length. do 2 f_equal.
  unfold pairs, unbent, images. now rewrite !map_map.
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
Definition bends_as (k : (R -> R) * layer) (b : @bent_layer R) :=
  bent (fst (fst b)) (fst k) /\ bias_fits (snd k) /\ snd b = weights k /\ fits (weights k) (snd (fst b)).

(** From h, h' on. *)
Lemma bent_layers t hidden bs last b h h' :
  length t = length h -> length h' = length h -> length b = length last -> Forall2 bends_as hidden bs ->
  let dz := minus h h' in
  exists rest, form (bent_lmiR 2 (-1) (-2) t bs last) (dz ++ rest) <=
    2 * dotR dz (timesR t dz) - square (minus (network hidden (last, b) h) (network hidden (last, b) h')).
Proof.
  simpl. intros Ht Hh Hb H. revert t h h' Ht Hh. unfold bent_lmi.
  induction H as [|[f [m c]] [[g t2] m2] hidden bs (Hf & Hc & E & Ht2 & Hp2) H IH]; intros t h h' Ht Hh.
  - exists []. rewrite app_nil_r, form_sum, form_scale. simpl. rewrite form_sum, form_scale, minus_affine by auto.
    assert (length (minus h h') = length t) as <- by (rewrite length_minus; auto).
    rewrite form_gram_columns, form_diagonal by (unfold scale; rewrite map_length, length_minus; auto).
    rewrite times_scale, dot_scale_r. lra.
  - unfold bias_fits, weights in *. simpl in *. subst m2.
    set (y := affine m c h) in *. set (y' := affine m c h').
    assert (length y = length m) as Hy by (unfold y; now apply length_affine).
    assert (length y' = length m) as Hy' by (unfold y'; now apply length_affine).
    set (z := map f y). set (z' := map f y').
    assert (length z = length m) as Hz by (unfold z; now rewrite map_length).
    assert (length z' = length m) as Hz' by (unfold z'; now rewrite map_length).
    destruct (IH t2 z z') as [rest Hrest]; try congruence.
    exists (minus z z' ++ rest).
    rewrite form_sum, form_scale in Hrest |- *.
    assert (length (minus h h') = length t) as L by (rewrite length_minus; auto).
    rewrite <- L, form_block by (unfold scale; rewrite ?map_length, ?length_columns; auto).
    rewrite form_weighted_gram_app by apply length_columns. rewrite form_bend.
    rewrite dot_columns, (dot_comm (_ ++ _)), dot_app_short
      by (rewrite length_minus by congruence; unfold apply, scale_all; rewrite !map_length, length_scale_rows; lia).
    rewrite apply_scale_all, apply_scale_rows, dot_scale_l, (dot_comm _ (minus z z')), !times_scale, !dot_scale_r.
    pose proof (bent_constraint g f t2 y y' Hf Hp2 ltac:(congruence)) as C. fold z z' in C. simpl in C.
    unfold y, y' in C. rewrite minus_affine in C by auto.
    lra.
Qed.

Theorem bent_lmi_bounds rho n hidden bs last b x x' : bias_fits (last, b) -> Forall2 bends_as hidden bs ->
  nonnegative (bent_lmiR 2 (-1) (-2) (repeat (rho / 2) n) bs last) -> length x = n -> length x' = n ->
  square (minus (network hidden (last, b) x) (network hidden (last, b) x')) <= rho * square (minus x x').
Proof.
  intros Hb H HP Hx Hx'. destruct (bent_layers (repeat (rho / 2) n) hidden bs last b x x') as [rest G]; auto.
  - now rewrite repeat_length.
  - congruence.
  - specialize (HP (minus x x' ++ rest)). set (d := minus x x') in *.
    assert (length d = n) as L by (unfold d; rewrite length_minus; congruence).
    assert (2 * dotR d (timesR (repeat (rho / 2) n) d) = rho * square d) as E; [|lra].
    rewrite <- L. unfold square. clear. induction d as [|a d IH]; simpl; [ring|]. nra.
Qed.
